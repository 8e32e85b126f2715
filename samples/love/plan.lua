-- Plans a way to win without being seen, with the same queries that the guards use. As long as they see nobody, the guards' paths
-- do not depend on the player. So their positions are known beforehand, and a search over cells, times and gems finds the
-- shortest way. For tests: it shows that the game can be won with a given mesh.
local Guard = require("guard")
local game = require("game")
local museum = require("museum")

local plan = {}
plan.BEAT = 0.8 -- seconds; a step from cell to cell takes less
local LOOK = 0.1 -- seconds between two checks whether somebody sees the thief
local MARGIN = 0.1 -- seconds that guards may be early or late
local LONGEST = 150 -- beats

-- The guards' positions at every check.
local function patrols()
  local guards, looks = {}, {}
  for i, path in ipairs(game.PATHS) do guards[i] = Guard.new(path) end
  local steps = math.floor(LOOK / game.STEP + 0.5)
  for look = 0, math.ceil((LONGEST + 1) * plan.BEAT / LOOK) + 2 do
    local now = {}
    for i, guard in ipairs(guards) do now[i] = { x = guard.x, z = guard.z, heading = guard.heading } end
    looks[look] = now
    for _ = 1, steps do
      for _, guard in ipairs(guards) do guard:move(game.STEP) end
    end
  end
  return looks
end

-- Returns true if a body can go straight from one place to another.
function plan.passable(scene, ax, az, bx, bz)
  local length = math.sqrt((bx - ax) ^ 2 + (bz - az) ^ 2)
  local steps = math.max(1, math.ceil(length / 0.05))
  for i = 0, steps do
    if not museum.free(scene, ax + (bx - ax) * i / steps, az + (bz - az) * i / steps) then return false end
  end
  return true
end

local function key(column, row)
  return (row - 1) * museum.columns + column
end

-- For each cell, the cells that a step reaches: its neighbours, or the cell itself.
function plan.steps(scene)
  local reach = {}
  for row = 1, museum.rows do
    for column = 1, museum.columns do
      local list = {}
      local x, z = museum.centre(column, row)
      if museum.free(scene, x, z) then
        for _, d in ipairs({ { 0, 0 }, { 1, 0 }, { -1, 0 }, { 0, 1 }, { 0, -1 } }) do
          local c, r = column + d[1], row + d[2]
          local bx, bz = museum.centre(c, r)
          if museum.at(c, r) and plan.passable(scene, x, z, bx, bz) then list[#list + 1] = { c, r } end
        end
      end
      reach[key(column, row)] = list
    end
  end
  return reach
end

local function unseen(scene, looks, from, to, beat)
  local ax, az = museum.centre(from[1], from[2])
  local bx, bz = museum.centre(to[1], to[2])
  local dx, dz = bx - ax, bz - az
  local length = math.sqrt(dx * dx + dz * dz)
  local eyes = setmetatable({}, Guard)
  local wait = math.floor(MARGIN / LOOK + 0.5)
  for i = 0, math.ceil(plan.BEAT / LOOK) do
    local part = length > 0 and math.min(1, i * LOOK * game.SPEED / length) or 0
    local x, z = ax + dx * part, az + dz * part
    local now = math.floor(beat * plan.BEAT / LOOK + 0.5) + i
    for look = math.max(0, now - wait), now + wait do
      for _, guard in ipairs(looks[look]) do
        eyes.x, eyes.z, eyes.heading, eyes.stare = guard.x, guard.z, guard.heading, 0
        eyes:look(scene, x, z)
        if eyes.seen > 0 or (x - eyes.x) ^ 2 + (z - eyes.z) ^ 2 < 1.2 then return false end
      end
    end
  end
  return true
end

-- Returns the way, a list of cells {column, row}, one for each beat, from the start to the exit with all gems; or nil.
function plan.win(scene)
  local looks, reach = patrols(), plan.steps(scene)
  local gems, all = {}, 0
  for i, cell in ipairs(museum.find("*")) do
    gems[key(cell[1], cell[2])] = 2 ^ (i - 1)
    all = all + 2 ^ (i - 1)
  end
  local start, exit = museum.find("S")[1], museum.find("E")[1]
  local known, layer = {}, { { cell = start, taken = 0 } }
  for beat = 0, LONGEST - 1 do
    local next_layer, here = {}, {}
    for _, state in ipairs(layer) do
      for _, cell in ipairs(reach[key(state.cell[1], state.cell[2])]) do
        local move = key(state.cell[1], state.cell[2]) .. ">" .. key(cell[1], cell[2])
        if known[move] == nil then known[move] = unseen(scene, looks, state.cell, cell, beat) end
        if known[move] then
          local gem = gems[key(cell[1], cell[2])]
          local taken = state.taken
          if gem and math.floor(taken / gem) % 2 == 0 then taken = taken + gem end
          local name = key(cell[1], cell[2]) .. ":" .. taken
          if not here[name] then
            here[name] = true
            local state_next = { cell = cell, taken = taken, from = state }
            if taken == all and cell[1] == exit[1] and cell[2] == exit[2] then
              local way = {}
              while state_next do
                table.insert(way, 1, state_next.cell)
                state_next = state_next.from
              end
              return way
            end
            next_layer[#next_layer + 1] = state_next
          end
        end
      end
    end
    layer, known = next_layer, {}
  end
  return nil
end

-- The way as lines of a script; see script.lua.
function plan.script(way)
  local lines = {}
  for i = 2, #way do
    lines[#lines + 1] = ("at %.1f"):format((i - 2) * plan.BEAT)
    lines[#lines + 1] = ("walk %d %d"):format(way[i][1], way[i][2])
  end
  return table.concat(lines, "\n") .. "\n"
end

return plan
