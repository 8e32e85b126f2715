-- The hall: which cells have a statue, where the statues stand in nifkit's scene, and where there is room to walk.
--
-- Positions are in metres: x to the right, z down the screen, y up from the floor.
local nif = require("nif")

local museum = {}
museum.CELL = 2.4
museum.BODY = 0.32 -- radius of whoever walks here
local LENGTH = 1.18 * museum.CELL -- of a statue; neighbours in a row touch
local HEIGHTS = { 0.25, 0.8, 1.35 } -- at which a body bumps into statues, and is seen

-- # statue, S start, E exit, * gem
local MAP = {
  "....#......#.......E",
  ".#..#.####.#.####.##",
  ".#....#*.#....#...#.",
  ".####.#..####.#.###.",
  "......#.......#.....",
  "##.##.###.###.###.##",
  "......#.......#.....",
  ".####.#.####..#.###.",
  ".#*...#....#....#.*.",
  ".#.##.####.#.####.#.",
  "S...#......#......#.",
}
museum.columns, museum.rows = #MAP[1], #MAP
museum.width, museum.depth = museum.columns * museum.CELL, museum.rows * museum.CELL
museum.heights = HEIGHTS

-- The centre of a cell; columns and rows count from 1.
function museum.centre(column, row)
  return (column - 0.5) * museum.CELL, (row - 0.5) * museum.CELL
end

function museum.at(column, row)
  if row < 1 or row > museum.rows or column < 1 or column > museum.columns then return nil end
  return MAP[row]:sub(column, column)
end

function museum.cell_of(x, z)
  return math.floor(x / museum.CELL) + 1, math.floor(z / museum.CELL) + 1
end

-- All cells with this sign, as {column, row}.
function museum.find(sign)
  local found = {}
  for row = 1, museum.rows do
    for column = 1, museum.columns do
      if museum.at(column, row) == sign then found[#found + 1] = { column, row } end
    end
  end
  return found
end

-- 0 .. 1, depends only on the cell.
local function chance(column, row, number)
  local value = math.sin(column * 12.9898 + row * 78.233 + number * 37.719) * 43758.5453
  return value - math.floor(value)
end

-- Along x (0) or z (a quarter turn), like its neighbours; slightly rotated, and facing either way.
local function angle_of(column, row)
  local function statue(c, r) return museum.at(c, r) == "#" and 1 or 0 end
  local beside = statue(column - 1, row) + statue(column + 1, row)
  local above = statue(column, row - 1) + statue(column, row + 1)
  local along_x = beside > above or (beside == above and chance(column, row, 0) < 0.5)
  local angle = along_x and 0 or math.pi / 2
  if chance(column, row, 1) < 0.5 then angle = angle + math.pi end
  return angle + 0.24 * (chance(column, row, 2) - 0.5)
end

-- Object to world: the asset's box stands on the floor in the centre of the cell, with its longer side along the angle. `up` is
-- the asset's axis that points up, "y" or "z".
local function place(low, high, up, column, row)
  local u = up == "z" and 2 or 1
  local a, b = (u + 1) % 3, (u + 2) % 3 -- the other two, so that (a, b, up) is right-handed
  local length_a, length_b = high[a] - low[a], high[b] - low[b]
  local scale = LENGTH / math.max(length_a, length_b)
  local angle = angle_of(column, row)
  -- (z, x, y) is also right-handed: b goes along x if it is the longer one, otherwise a quarter turn more.
  if length_a > length_b then angle = angle + math.pi / 2 end
  local c, s = scale * math.cos(angle), scale * math.sin(angle)
  local t = {}
  for i = 1, 12 do t[i] = 0 end
  t[1 + a], t[1 + b] = s, c
  t[5 + u] = scale
  t[9 + a], t[9 + b] = c, -s
  local x, z = museum.centre(column, row)
  local middle_a, middle_b = (low[a] + high[a]) / 2, (low[b] + high[b]) / 2
  t[4] = x - s * middle_a - c * middle_b
  t[8] = -scale * low[u]
  t[12] = z - c * middle_a + s * middle_b
  return t
end

-- Builds the scene of all statues. Returns it, or nil and a sentence.
function museum.build(device, asset, up)
  local fine, why = asset:answers_all()
  if not fine then return nil, why or "an asset of the encoding proof leaves rays open; bake another one" end
  local alone
  alone, why = device:scene()
  if not alone then return nil, why end
  fine, why = alone:add_asset(asset)
  if fine then fine, why = alone:commit() end
  if not fine then return nil, why end
  local low, high = alone:bounds()
  if not low then return nil, high end
  for axis = 0, 2 do
    if not (high[axis] > low[axis]) then return nil, "the asset is empty or flat" end
  end
  local scene
  scene, why = device:scene()
  if not scene then return nil, why end
  for _, cell in ipairs(museum.find("#")) do
    fine, why = scene:add_asset(asset, place(low, high, up, cell[1], cell[2]))
    if not fine then return nil, why end
  end
  fine, why = scene:commit()
  if not fine then return nil, why end
  return scene
end

-- 1 if a body has room at x, z: at none of the heights is a statue closer than its radius.
local AROUND = 24
local room = nif.rays(AROUND * #HEIGHTS)
function museum.free(scene, x, z)
  local r = museum.BODY
  if x < r or z < r or x > museum.width - r or z > museum.depth - r then return false end
  local i = 0
  for _, height in ipairs(HEIGHTS) do
    for k = 0, AROUND - 1 do
      local angle = 2 * math.pi * k / AROUND
      room:set(i, x, height, z, r * math.cos(angle), 0, r * math.sin(angle), 1)
      i = i + 1
    end
  end
  assert(scene:query(room, i))
  for k = 0, i - 1 do
    if room.visible[k] == 0 then return false end
  end
  return true
end

-- Moves a body as far as there is room, sliding along statues if it cannot go straight. Returns the new position.
function museum.walk(scene, x, z, dx, dz)
  if museum.free(scene, x + dx, z + dz) then return x + dx, z + dz end
  -- Slide: tries the directions closest to the wanted one first.
  local angle, length = math.atan2(dz, dx), math.sqrt(dx * dx + dz * dz)
  for _, turn in ipairs({ 0.4, -0.4, 0.8, -0.8, 1.2, -1.2 }) do
    local sx = length * math.cos(turn) * math.cos(angle + turn)
    local sz = length * math.cos(turn) * math.sin(angle + turn)
    if museum.free(scene, x + sx, z + sz) then return x + sx, z + sz end
  end
  return x, z
end

return museum
