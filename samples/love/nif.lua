-- nifkit for LuaJIT: loads libnif.so, and wraps the functions that the game uses. Every function that can fail returns nil and
-- a sentence.
local ffi = require("ffi")
ffi.cdef(require("nif_cdef"))

local nif = {}
local C -- the library, once it is loaded
local VERSION = "0.1" -- of nif.h that nif_cdef.lua was made from; before 1.0, other minor versions may differ

local function sentence()
  return ffi.string(C.nifGetErrorMessage())
end

-- Loads the library: from `path`, or from where the system finds it. To be called first.
function nif.load(path)
  local names = path and { path } or { "libnif.so." .. VERSION, "libnif.so" }
  local why
  for _, name in ipairs(names) do
    -- A plain name would only be searched in the system's folders.
    local file = path and not name:find("/") and "./" .. name or name
    local fine, found = pcall(ffi.load, file)
    if fine then
      local known, number = pcall(function() return found.nifGetVersion() end)
      if not known then return nil, ("%s is not nifkit's runtime: it has no nifGetVersion"):format(name) end
      local version = ("%d.%d"):format(math.floor(number / 10000), math.floor(number / 100) % 100)
      if version ~= VERSION then
        return nil, ("%s is version %s of nifkit's runtime; this game is made for %s"):format(name, version, VERSION)
      end
      C = found
      return true
    end
    why = why or tostring(found)
  end
  return nil, ("cannot load nifkit's runtime, %s: %s"):format(path or "libnif.so", why)
end

local Device, Asset, Scene, Rays = {}, {}, {}, {}
Device.__index, Asset.__index, Scene.__index, Rays.__index = Device, Asset, Scene, Rays

-- A device with `threads` threads; 0: one for each core.
function nif.device(threads)
  local out = ffi.new("NifDevice[1]")
  if C.nifNewDevice("threads=" .. threads, nil, out) ~= C.NIF_OK then return nil, sentence() end
  return setmetatable({ handle = ffi.gc(out[0], C.nifReleaseDevice) }, Device)
end

-- Threads and instruction set.
function Device:info()
  local info = ffi.new("NifDeviceInfo", { struct_size = ffi.sizeof("NifDeviceInfo") })
  if C.nifGetDeviceInfo(self.handle, info) ~= C.NIF_OK then return nil, sentence() end
  return { threads = info.threads, isa = ffi.string(info.isa) }
end

-- Loads a .nif file.
function Device:load(path)
  local out = ffi.new("NifAsset[1]")
  if C.nifLoadAssetFile(self.handle, path, C.NIF_LOAD_COPY, out) ~= C.NIF_OK then return nil, sentence() end
  return setmetatable({ handle = ffi.gc(out[0], C.nifReleaseAsset) }, Asset)
end

-- False if it leaves rays open (the encoding proof) for a BVH, which this game does not have.
function Asset:answers_all()
  local info = ffi.new("NifAssetInfo", { struct_size = ffi.sizeof("NifAssetInfo") })
  if C.nifGetAssetInfo(self.handle, info) ~= C.NIF_OK then return nil, sentence() end
  for i = 0, info.object_count - 1 do
    local object = ffi.new("NifObjectInfo", { struct_size = ffi.sizeof("NifObjectInfo") })
    if C.nifGetObjectInfo(self.handle, i, object) ~= C.NIF_OK then return nil, sentence() end
    if object.encoding == C.NIF_ENCODING_PROOF then return false end
  end
  return true
end

function Device:scene()
  local out = ffi.new("NifScene[1]")
  if C.nifNewScene(self.handle, out) ~= C.NIF_OK then return nil, sentence() end
  return setmetatable({ handle = ffi.gc(out[0], C.nifReleaseScene) }, Scene)
end

-- Adds an asset. `transform` is a table of 12 numbers, a row-major 3x4 matrix, or nil.
function Scene:add_asset(asset, transform)
  local matrix = transform and ffi.new("float[12]", transform)
  if C.nifAddAsset(self.handle, asset.handle, matrix, nil, nil) ~= C.NIF_OK then return nil, sentence() end
  return true
end

function Scene:commit()
  if C.nifCommitScene(self.handle) ~= C.NIF_OK then return nil, sentence() end
  return true
end

-- The bounding box of everything at the last commit: two tables of x, y, z, indexed from 0. Also the number of instances.
function Scene:bounds()
  local info = ffi.new("NifSceneInfo", { struct_size = ffi.sizeof("NifSceneInfo") })
  if C.nifGetSceneInfo(self.handle, info) ~= C.NIF_OK then return nil, sentence() end
  local low, high = {}, {}
  for axis = 0, 2 do low[axis], high[axis] = info.bounds_min[axis], info.bounds_max[axis] end
  return low, high, info.instance_count
end

-- Memory for `capacity` rays and their answers: visible[i] is 1 or 0; t[i] is infinite if nothing is hit; normal[3 * i + axis].
-- All indices start at 0.
function nif.rays(capacity)
  local rays = setmetatable({
    capacity = capacity,
    ray = ffi.new("NifRay[?]", capacity),
    visible = ffi.new("uint8_t[?]", capacity),
    t = ffi.new("float[?]", capacity),
    normal = ffi.new("float[?]", 3 * capacity),
    batch = ffi.new("NifRays", { struct_size = ffi.sizeof("NifRays") }),
    answers = ffi.new("NifAnswers", { struct_size = ffi.sizeof("NifAnswers") }),
    hits = ffi.new("NifHits", { struct_size = ffi.sizeof("NifHits") }),
  }, Rays)
  local batch, first = rays.batch, rays.ray[0]
  for axis = 0, 2 do
    batch.origin[axis] = first.origin + axis
    batch.direction[axis] = first.direction + axis
  end
  local base, size = ffi.cast("const char*", rays.ray), ffi.sizeof("NifRay")
  batch.tmin = ffi.cast("const float*", base + ffi.offsetof("NifRay", "tmin"))
  batch.tmax = ffi.cast("const float*", base + ffi.offsetof("NifRay", "tmax"))
  batch.origin_stride, batch.direction_stride, batch.tmin_stride, batch.tmax_stride = size, size, size, size
  rays.answers.visible = rays.visible
  rays.hits.t, rays.hits.normal = rays.t, rays.normal
  return rays
end

-- Sets ray i to the points origin + t direction with 0 <= t <= tmax.
function Rays:set(i, ox, oy, oz, dx, dy, dz, tmax)
  local ray = self.ray[i]
  ray.origin[0], ray.origin[1], ray.origin[2] = ox, oy, oz
  ray.direction[0], ray.direction[1], ray.direction[2] = dx, dy, dz
  ray.tmin, ray.tmax = 0, tmax
end

-- Number of rays queried so far by this program, for the display.
nif.asked = 0

local function prepare(rays, count)
  assert(count <= rays.capacity, "more rays than there is room for")
  rays.batch.count = count
  nif.asked = nif.asked + count
end

-- Answers the first `count` rays: writes rays.visible.
function Scene:query(rays, count)
  prepare(rays, count)
  if C.nifQuery(self.handle, rays.batch, rays.answers) ~= C.NIF_OK then return nil, sentence() end
  return true
end

-- Finds the first hits of the first `count` rays: writes rays.t and rays.normal.
function Scene:intersect(rays, count)
  prepare(rays, count)
  if C.nifIntersect(self.handle, rays.batch, rays.hits) ~= C.NIF_OK then return nil, sentence() end
  return true
end

return nif
