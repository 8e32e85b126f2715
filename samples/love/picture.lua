-- Paints the hall as seen from above, only with rays: first hits straight down, then rays from there to a soft moon and to the
-- sky. Works row by row, so that a loading bar can move.
local ffi = require("ffi")
local museum = require("museum")
local nif = require("nif")

local picture = {}

local FINE = 2 -- samples along each side of a pixel
local SKY = 6 -- rays to the sky from each sample
local CAMERA = 20 -- metres above the floor
local OFF = 0.012 -- distance in metres at which rays start off the surface
local MOON = { -0.52, 0.72, -0.46 } -- its direction, of nearly unit length
local SPREAD = 0.06 -- how large it is
local FAR = 60 -- length of rays to the moon and the sky in metres

-- Directions over the hemisphere with cosine density, on a spiral of the golden angle.
local sky = {}
for i = 0, SKY - 1 do
  local r, angle = math.sqrt((i + 0.5) / SKY), 2.399963 * i
  sky[i] = { r * math.cos(angle), math.sqrt(1 - r * r), r * math.sin(angle) }
end

-- 0 .. 1, well mixed: the fraction of a plane over the pixels (interleaved gradient noise).
local function noise(x, y)
  local value = 52.9829189 * ((0.06711056 * x + 0.00583715 * y) % 1)
  return value % 1
end

-- The floor: slabs in two greys, with joints. Returns a grey, 0 to 1.
local function slab(x, z)
  local size = museum.CELL / 2
  local u, v = x / size, z / size
  local fu, fv = u % 1, v % 1
  if fu < 0.018 or fv < 0.018 then return 0.12 end
  local i, j = math.floor(u), math.floor(v)
  local value = math.sin(i * 12.9898 + j * 78.233) * 43758.5453
  return ((i + j) % 2 == 0 and 0.26 or 0.205) + 0.04 * (value - math.floor(value))
end

-- Rays of one row of samples: straight down, and up again from the hits.
local function new_line(scene, count, scale)
  local down, up = nif.rays(count), nif.rays(count * (SKY + 1))
  local line = {}

  -- The hits of the row at z: position, normal, and whether they are on a statue.
  local function landing(i, z)
    local x = (i + 0.5) / scale
    if down.t[i] >= CAMERA then return x, 0, z, 0, 1, 0, false end
    local nx, ny, nz = down.normal[3 * i], down.normal[3 * i + 1], down.normal[3 * i + 2]
    return x, CAMERA - down.t[i], z, nx, ny, nz, true
  end

  -- Traces all rays of the row number `row`.
  function line.ask(row)
    local z = (row + 0.5) / scale
    for i = 0, count - 1 do down:set(i, (i + 0.5) / scale, CAMERA, z, 0, -1, 0, CAMERA) end
    assert(scene:intersect(down, count))
    local k = 0
    for i = 0, count - 1 do
      local x, y, _, nx, ny, nz, statue = landing(i, z)
      x, y = x + OFF * nx, y + OFF * ny
      local oz = z + OFF * nz
      local angle, r = 2 * math.pi * noise(i, row), SPREAD * math.sqrt(noise(i + 51, row + 17))
      local c, s = math.cos(angle), math.sin(angle)
      up:set(k, x, y, oz, MOON[1] + r * c, MOON[2], MOON[3] + r * s, FAR)
      k = k + 1
      for d = 0, SKY - 1 do
        -- The sky's directions, rotated by the noise. On a statue, they are mirrored at the line between up and the normal, which
        -- maps one to the other.
        local from = sky[d]
        local dx, dy, dz = c * from[1] - s * from[3], from[2], s * from[1] + c * from[3]
        local size = nx * nx + (ny + 1) ^ 2 + nz * nz
        if statue and size > 1e-6 then
          local f = 2 * (dx * nx + dy * (ny + 1) + dz * nz) / size
          dx, dy, dz = f * nx - dx, f * (ny + 1) - dy, f * nz - dz
        end
        up:set(k, x, y, oz, dx, dy, dz, FAR)
        k = k + 1
      end
    end
    assert(scene:query(up, k))
    line.z = z
  end

  -- The colour of sample i of that row: red, green and blue, 0 to 1, encoded for a screen.
  function line.color(i)
    local x, _, z, nx, ny, nz, statue = landing(i, line.z)
    local first = i * (SKY + 1)
    local moon = up.visible[first] * math.max(0, nx * MOON[1] + ny * MOON[2] + nz * MOON[3])
    local open = 0
    for d = 1, SKY do open = open + up.visible[first + d] end
    local red, green, blue, lit
    if statue then -- marble, with a slight glow from within
      red, green, blue, lit = 0.97, 0.94, 0.88, 0.12 + 0.75 * open / SKY + 0.75 * moon
    else
      local grey = slab(x, z)
      red, green, blue, lit = grey, 0.97 * grey, 0.95 * grey, 0.62 * open / SKY + 0.6 * moon
    end
    return math.min(1, math.sqrt(red * lit)), math.min(1, math.sqrt(green * lit)), math.min(1, math.sqrt(blue * lit))
  end

  return line
end

-- Returns a function that paints the next row into `pixels` (uint8_t, 4 per pixel, width x height, `scale` pixels per metre) and
-- returns the fraction done, 0 to 1. Each pixel is the mean of FINE x FINE samples.
function picture.painter(scene, pixels, width, height, scale)
  local line = new_line(scene, FINE * width, FINE * scale)
  local sums = ffi.new("float[?]", 3 * width)
  local row = 0
  return function()
    ffi.fill(sums, ffi.sizeof(sums))
    for part = 0, FINE - 1 do
      line.ask(FINE * row + part)
      for i = 0, FINE * width - 1 do
        local at = 3 * math.floor(i / FINE)
        local red, green, blue = line.color(i)
        sums[at], sums[at + 1], sums[at + 2] = sums[at] + red, sums[at + 1] + green, sums[at + 2] + blue
      end
    end
    for i = 0, width - 1 do
      local to = 4 * (row * width + i)
      for channel = 0, 2 do pixels[to + channel] = 255 * sums[3 * i + channel] / (FINE * FINE) end
      pixels[to + 3] = 255
    end
    row = row + 1
    return row / height
  end
end

return picture
