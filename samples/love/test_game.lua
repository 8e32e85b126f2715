-- Tests the game without a window; run by luajit: its queries to nifkit, its rules, and that it can be won.
--
--   luajit test_game.lua LIBRARY ASSET SMALL_ASSET SCRATCH_FOLDER [UP]     writes SCRATCH_FOLDER/win.txt, a script that wins
local folder = arg[0]:match("^(.*)/") or "."
package.path = folder .. "/?.lua;" .. package.path
local ffi = require("ffi")
local nif = require("nif")
local library, asset_path, small_path, scratch, up = arg[1], arg[2], arg[3], arg[4], arg[5] or "y"

local failures = 0
local function check(fine, text)
  if fine then return end
  failures = failures + 1
  io.stderr:write("test_game.lua: ", text, "\n")
end
local function refused(text, result, why)
  local fine = result == nil and type(why) == "string" and why:find(text, 1, true)
  check(fine, ("no error with '%s', but: %s"):format(text, tostring(why)))
end

-- Errors of loading.
refused("no_such.so", nif.load(scratch .. "/no_such.so"))
refused("it has no nifGetVersion", nif.load(scratch .. "/libplain.so")) -- test.sh makes this one and the next
refused("is version 0.2", nif.load(scratch .. "/libother.so"))
assert(nif.load(library))
local museum, sight, Guard, game, plan = require("museum"), require("sight"), require("guard"), require("game"), require("plan")

local device = assert(nif.device(1))
refused("no_such.nif", device:load(scratch .. "/no_such.nif"))
refused(arg[0], device:load(arg[0]))
refused("threads", nif.device(-1))
local asset = assert(device:load(asset_path))
local scene = assert(museum.build(device, asset, up))

-- Each statue stands in its cell, on the floor.
local low, high, count = scene:bounds()
check(count >= #museum.find("#"), "fewer instances than statues")
for axis, reach in pairs({ [0] = museum.width, [2] = museum.depth }) do
  check(low[axis] > -museum.CELL and high[axis] < reach + museum.CELL, "statues stand outside the hall")
end
check(math.abs(low[1]) < 0.1 and high[1] > 0.5, ("statues reach from %.2f to %.2f m"):format(low[1], high[1]))
local down = nif.rays(1)
local beside = 0
for row = 1, museum.rows do
  for column = 1, museum.columns do
    local x, z = museum.centre(column, row)
    local sign = museum.at(column, row)
    if sign == "#" then
      -- Somewhere in the cell, a ray from above hits it, and there is no room at that point.
      local met = false
      for i = -5, 5 do
        for k = -5, 5 do
          down:set(0, x + 0.2 * i, 20, z + 0.2 * k, 0, -1, 0, 20)
          assert(scene:intersect(down, 1))
          met = met or down.t[0] < 20
        end
      end
      check(met, ("there is no statue in cell %d %d"):format(column, row))
    else
      check(museum.free(scene, x, z), ("there is no room in cell %d %d"):format(column, row))
      beside = beside + 1
    end
  end
end
check(beside + #museum.find("#") == museum.rows * museum.columns, "cells are missing")

-- A ray is visible if it hits nothing: nifQuery and nifIntersect agree, as nif.h promises.
local rays = nif.rays(20000)
math.randomseed(19)
for i = 0, rays.capacity - 1 do
  local x, z, angle = math.random() * museum.width, math.random() * museum.depth, 2 * math.pi * math.random()
  rays:set(i, x, 2 * math.random(), z, math.cos(angle), 0.2 * (math.random() - 0.5), math.sin(angle), 6)
end
assert(scene:query(rays, rays.capacity))
local visible = ffi.new("uint8_t[?]", rays.capacity)
ffi.copy(visible, rays.visible, rays.capacity)
assert(scene:intersect(rays, rays.capacity))
local differ, hidden = 0, 0
for i = 0, rays.capacity - 1 do
  if (rays.t[i] == math.huge) ~= (visible[i] == 1) then differ = differ + 1 end
  hidden = hidden + (1 - visible[i])
end
check(differ == 0, differ .. " rays are visible and meet something, or neither")
check(hidden > 1000 and hidden < 19000, ("%d of 20,000 rays are hidden"):format(hidden))

-- Walking: straight if there is room, never into a statue, never out of the hall.
local start = museum.find("S")[1]
local x, z = museum.centre(start[1], start[2])
for i = 1, 4000 do
  local angle = 2.399963 * i
  for _ = 1, 10 do
    x, z = museum.walk(scene, x, z, 0.05 * math.cos(angle), 0.05 * math.sin(angle))
    if not museum.free(scene, x, z) then
      check(false, ("a walker got stuck in a statue at %.2f %.2f"):format(x, z))
      break
    end
  end
end
check(x >= 0 and z >= 0 and x <= museum.width and z <= museum.depth, "a walker left the hall")

-- Guards: their paths are free. They see along a corridor, but not behind themselves or through a wall of statues.
for number, path in ipairs(game.PATHS) do
  for i, cell in ipairs(path) do
    local to = path[i % #path + 1]
    local ax, az = museum.centre(cell[1], cell[2])
    local bx, bz = museum.centre(to[1], to[2])
    check(plan.passable(scene, ax, az, bx, bz), ("guard %d cannot go from %d %d on"):format(number, cell[1], cell[2]))
  end
end
local guard = Guard.new({ { 1, 5 }, { 6, 5 } })
guard:look(scene, museum.centre(3, 5))
check(guard.seen > 0.5, "a guard does not see who stands in front of him: " .. guard.seen)
guard.heading = math.pi
guard:look(scene, museum.centre(3, 5))
check(guard.seen == 0, "a guard sees behind himself")
local gx, gz = museum.centre(3, 5)
local hx, hz = museum.centre(3, 3)
local through = sight.share(scene, gx, gz, hx, hz)
check(through < 0.75, ("%.0f %% of a body are seen through a wall of statues"):format(100 * through))
local ox, oz = museum.centre(5, 5)
check(sight.share(scene, gx, gz, ox, oz) == 1, "a body in the open is not seen entirely")

-- Rules: a player in the light is caught, one outside is not, and a new game starts like the first.
local standing = game.new(scene)
standing.x, standing.z = museum.centre(4, 5)
local steps = 0
while standing.state == "playing" and steps < 60 * 30 do
  standing:step(0, 0)
  steps = steps + 1
end
check(standing.state == "caught", "who stands in a guard's way is not caught")
local function trace()
  local one, sum = game.new(scene), {}
  for i = 1, 1200 do
    one:step(math.sin(i / 40), math.cos(i / 90) - 0.5)
    sum[#sum + 1] = ("%.17g %.17g %.17g"):format(one.x, one.z, one.alarm)
  end
  return table.concat(sum, ";")
end
check(trace() == trace(), "the same moves end otherwise")

-- It can be won, unseen.
local way = plan.win(scene)
if way then
  local text = plan.script(way)
  local file = assert(io.open(scratch .. "/win.txt", "w"))
  file:write(text)
  file:close()
  local player = assert(require("script").new(text, "win.txt"))
  local played, most = game.new(scene), 0
  while true do
    local dx, dz = player:next(played, game.STEP)
    if type(dx) ~= "number" then
      check(dx == "end", tostring(dz))
      break
    end
    played:step(dx, dz)
    most = math.max(most, played.alarm)
  end
  check(played.state == "won" and played:gems_left() == 0, "the plan does not win: " .. played.state)
  check(most == 0, "the plan is seen")
  print(("won unseen in %.1f s, with all gems"):format(played.time))
else
  check(false, "nobody can win without being seen")
end

-- Scripts that cannot be read, and scripts with wrong expectations.
local Script = require("script")
local unreadable = { "jump", "walk 1", "walk 0 1", "wait x", "hold space", "press", "expect sleeping", "gems", "shot", "until won" }
for _, line in ipairs(unreadable) do
  refused("s.txt, line 2", Script.new("wait 1\n" .. line .. "\n", "s.txt"))
end
local hasty = assert(Script.new("expect won # not yet", "s.txt"))
refused("s.txt, line 1: expected won", hasty:next(game.new(scene), game.STEP))

-- No leaks: assets, scenes and rays are freed when Lua drops them.
local function resident()
  local file = assert(io.open("/proc/self/statm"))
  local _, pages = file:read("*n", "*n")
  file:close()
  return pages * 4096
end
local function load_and_drop(times)
  for i = 1, times do
    local one = assert(device:load(small_path))
    local hall = assert(device:scene())
    assert(hall:add_asset(one))
    assert(hall:commit())
    if i % 50 == 0 then collectgarbage() end
  end
  collectgarbage()
  collectgarbage()
end
load_and_drop(1000)
local before = resident()
load_and_drop(10000)
local grown = resident() - before
check(grown < 1e6, ("10,000 loads took %.1f MB"):format(grown / 1e6))
print(("10,000 loads and scenes: memory changed by %.0f kB"):format(grown / 1000))

if failures > 0 then
  io.stderr:write(("test_game.lua: %d failures\n"):format(failures))
  os.exit(1)
end
