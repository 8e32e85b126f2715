-- What guards see: the share of visible rays from a lantern to points of a body, and the same for a whole cone of light.
local museum = require("museum")
local nif = require("nif")

local sight = {}
sight.RANGE = 8.5 -- reach of a lantern in metres
sight.HALF = math.rad(34) -- half of the cone's angle
sight.LANTERN = 1.1 -- its height

local AROUND = 8 -- points of a body at each height
local body = nif.rays(AROUND * #museum.heights)

-- The share of a body at x, z that a lantern at from_x, from_z lights, 0 to 1, whichever way it points.
function sight.share(scene, from_x, from_z, x, z)
  local i = 0
  for _, height in ipairs(museum.heights) do
    for k = 0, AROUND - 1 do
      local angle = 2 * math.pi * (k + 0.5) / AROUND
      local px, pz = x + museum.BODY * math.cos(angle), z + museum.BODY * math.sin(angle)
      body:set(i, from_x, sight.LANTERN, from_z, px - from_x, height - sight.LANTERN, pz - from_z, 1)
      i = i + 1
    end
  end
  assert(scene:query(body, i))
  local count = 0
  for k = 0, i - 1 do count = count + body.visible[k] end
  return count / i
end

-- How much a point is within the cone, 0 to 1: less near its edges. `side` is the angle from its axis.
function sight.beam(side, distance)
  local across = 1 - math.min(1, math.abs(side) / sight.HALF)
  local along = 1 - distance / sight.RANGE
  if across <= 0 or along <= 0 then return 0 end
  return math.min(1, 5 * across) * math.min(1, 4 * along)
end

-- The light of a cone on a grid of ANGLES x RINGS points, for a picture: each is lit by the share of the heights that the
-- lantern reaches there.
sight.ANGLES, sight.RINGS = 97, 40
local cone = nif.rays(sight.ANGLES * sight.RINGS * #museum.heights)

-- Calls put(angle number, ring number, x, z, light) for each point; numbers start at 0. `light` is 0 to 1.
function sight.cone(scene, from_x, from_z, heading, put)
  local i = 0
  for a = 0, sight.ANGLES - 1 do
    local angle = heading + sight.HALF * (2 * a / (sight.ANGLES - 1) - 1)
    local dx, dz = math.cos(angle), math.sin(angle)
    for r = 0, sight.RINGS - 1 do
      local distance = sight.RANGE * (r + 0.5) / sight.RINGS
      for _, height in ipairs(museum.heights) do
        cone:set(i, from_x, sight.LANTERN, from_z, dx * distance, height - sight.LANTERN, dz * distance, 1)
        i = i + 1
      end
    end
  end
  assert(scene:query(cone, i))
  i = 0
  for a = 0, sight.ANGLES - 1 do
    local side = sight.HALF * (2 * a / (sight.ANGLES - 1) - 1)
    local dx, dz = math.cos(heading + side), math.sin(heading + side)
    for r = 0, sight.RINGS - 1 do
      local distance = sight.RANGE * (r + 0.5) / sight.RINGS
      local count = 0
      for _ = 1, #museum.heights do
        count = count + cone.visible[i]
        i = i + 1
      end
      local light = count / #museum.heights * sight.beam(side, distance)
      put(a, r, from_x + dx * distance, from_z + dz * distance, light)
    end
  end
end

return sight
