-- A guard walks along a path of cells, back and forth or in a loop, and stops to look when he sees somebody.
local museum = require("museum")
local sight = require("sight")

local Guard = {}
Guard.__index = Guard

local SPEED, TURN = 1.7, 2.6 -- metres and radians per second
local STARE = 1.2 -- seconds that he keeps looking at where he saw somebody

-- `path`: cells {column, row}. Each is in a straight line with the next, and the last one with the first.
function Guard.new(path)
  local self = setmetatable({ path = path, next = 2, seen = 0, stare = 0 }, Guard)
  self.x, self.z = museum.centre(path[1][1], path[1][2])
  local x, z = museum.centre(path[2][1], path[2][2])
  self.heading = math.atan2(z - self.z, x - self.x)
  return self
end

local function difference(a, b)
  return (a - b + math.pi) % (2 * math.pi) - math.pi
end

-- Turns towards an angle; returns true once it is reached.
function Guard:turn(angle, dt)
  local off = difference(angle, self.heading)
  local step = math.min(TURN * dt, math.abs(off))
  self.heading = self.heading + (off < 0 and -step or step)
  return math.abs(off) - step < 0.02
end

-- Looks for a body at x, z. self.seen is how well he sees it: 0 not at all, 1 fully and from nearby.
function Guard:look(scene, x, z)
  local dx, dz = x - self.x, z - self.z
  local distance = math.sqrt(dx * dx + dz * dz)
  local beam = sight.beam(difference(math.atan2(dz, dx), self.heading), distance)
  self.seen = beam > 0 and beam * sight.share(scene, self.x, self.z, x, z) or 0
  if self.seen > 0 then self.stare, self.look_x, self.look_z = STARE, x, z end
end

function Guard:move(dt)
  if self.stare > 0 then
    self.stare = self.stare - dt
    self:turn(math.atan2(self.look_z - self.z, self.look_x - self.x), dt)
    return
  end
  local x, z = museum.centre(self.path[self.next][1], self.path[self.next][2])
  local dx, dz = x - self.x, z - self.z
  local left = math.sqrt(dx * dx + dz * dz)
  if left < 1e-6 or (self:turn(math.atan2(dz, dx), dt) and left <= SPEED * dt) then
    self.x, self.z = x, z
    self.next = self.next % #self.path + 1
  elseif math.abs(difference(math.atan2(dz, dx), self.heading)) < 0.02 then
    self.x, self.z = self.x + dx / left * SPEED * dt, self.z + dz / left * SPEED * dt
  end
end

return Guard
