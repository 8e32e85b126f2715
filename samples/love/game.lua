-- The rules: take the gems, reach the exit, and do not let the alarm fill. Independent of windows and keys, so that tests can
-- play it, too. The same moves always give the same result, because time advances in steps of game.STEP.
local Guard = require("guard")
local museum = require("museum")

local game = {}
game.__index = game
game.STEP = 1 / 60

game.SPEED = 3.2 -- metres per second
-- How fast the alarm rises, per second, if the player is hardly seen and if fully seen, and how fast it falls.
local HARDLY, ENTIRELY, CALM = 0.3, 1.6, 0.3

local PATHS = {
  { { 1, 5 }, { 6, 5 }, { 6, 9 }, { 6, 7 }, { 1, 7 }, { 6, 7 }, { 6, 5 } },
  { { 14, 5 }, { 14, 3 }, { 11, 3 }, { 11, 1 }, { 11, 3 }, { 14, 3 }, { 14, 5 }, { 8, 5 } },
  { { 8, 7 }, { 14, 7 }, { 14, 9 }, { 16, 9 }, { 14, 9 }, { 14, 7 } },
  { { 20, 5 }, { 16, 5 }, { 18, 5 }, { 18, 7 }, { 20, 7 }, { 18, 7 }, { 18, 5 } },
}
game.PATHS = PATHS

-- A new game in a scene of museum.build.
function game.new(scene)
  local start, exit = museum.find("S")[1], museum.find("E")[1]
  local self = setmetatable({ scene = scene, state = "playing", alarm = 0, time = 0, guards = {}, gems = {} }, game)
  self.x, self.z = museum.centre(start[1], start[2])
  self.exit_x, self.exit_z = museum.centre(exit[1], exit[2])
  for i, path in ipairs(PATHS) do self.guards[i] = Guard.new(path) end
  for i, cell in ipairs(museum.find("*")) do
    local x, z = museum.centre(cell[1], cell[2])
    self.gems[i] = { x = x, z = z, taken = false }
  end
  return self
end

local function near(ax, az, bx, bz, reach)
  return (ax - bx) ^ 2 + (az - bz) ^ 2 < reach ^ 2
end

function game:gems_left()
  local left = 0
  for _, gem in ipairs(self.gems) do left = left + (gem.taken and 0 or 1) end
  return left
end

-- One step. dx, dz: the direction in which the player wants to go, of any length.
function game:step(dx, dz)
  if self.state ~= "playing" then return end
  local dt = game.STEP
  self.time = self.time + dt
  local length = math.sqrt(dx * dx + dz * dz)
  if length > 0 then
    local step = game.SPEED * dt / length
    self.x, self.z = museum.walk(self.scene, self.x, self.z, dx * step, dz * step)
  end
  for _, gem in ipairs(self.gems) do
    if near(self.x, self.z, gem.x, gem.z, 0.8) then gem.taken = true end
  end

  local seen = 0
  for _, guard in ipairs(self.guards) do
    guard:move(dt)
    guard:look(self.scene, self.x, self.z)
    seen = math.max(seen, guard.seen)
    if near(self.x, self.z, guard.x, guard.z, 2 * museum.BODY) then seen, self.alarm = 1, 1 end
  end
  self.seen = seen
  local rise = seen > 0 and HARDLY + (ENTIRELY - HARDLY) * seen or -CALM
  self.alarm = math.max(0, math.min(1, self.alarm + dt * rise))
  if self.alarm >= 1 then
    self.state = "caught"
  elseif self:gems_left() == 0 and near(self.x, self.z, self.exit_x, self.exit_z, 1) then
    self.state = "won"
  end
end

return game
