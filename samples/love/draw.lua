-- Draws a game: the painted hall, lit where lanterns reach, and a status bar above it.
local ffi = require("ffi")
local museum = require("museum")
local nif = require("nif")
local sight = require("sight")

local draw = {}
draw.SCALE = 80 / 3 -- pixels per metre
draw.BAR = 44 -- pixels, above the hall
draw.WIDTH = math.floor(museum.width * draw.SCALE + 0.5)
draw.HALL = math.floor(museum.depth * draw.SCALE + 0.5)
draw.HEIGHT = draw.BAR + draw.HALL

local NIGHT = { 0.29, 0.35, 0.5 } -- brightness without a lantern
local LANTERN = { 1.15, 0.9, 0.52 }
local DANGER = { 1.0, 0.34, 0.24 }
local PLAYER = { 0.36, 0.86, 0.95 }
local GEM = { 0.98, 0.55, 0.95 }
local EXIT = { 0.4, 1.0, 0.6 }

local g, fonts, hall, light, cone, vertices, glow, shader

local function font(size)
  fonts[size] = fonts[size] or g.newFont(size)
  return fonts[size]
end

-- A soft round light.
local function new_glow(size)
  local data = love.image.newImageData(size, size)
  data:mapPixel(function(x, y)
    local r = math.sqrt((x + 0.5 - size / 2) ^ 2 + (y + 0.5 - size / 2) ^ 2) / (size / 2)
    local value = math.max(0, 1 - r) ^ 2
    return value, value, value, 1
  end)
  return g.newImage(data)
end

-- The hall's colours, multiplied by the light.
local SHADER = [[
extern Image light;
vec4 effect(vec4 color, Image image, vec2 at, vec2 screen) {
  vec3 lit = Texel(image, at).rgb * Texel(light, at).rgb;
  return vec4(lit / (vec3(0.75) + 0.25 * lit), 1.0);
}
]]

-- `pixels`: ImageData of WIDTH x HALL. To be called once, with a window.
function draw.load(pixels)
  g, fonts = love.graphics, {}
  hall = g.newImage(pixels)
  light = g.newCanvas(draw.WIDTH, draw.HALL, { format = "rgba16f" })
  shader = g.newShader(SHADER)
  glow = new_glow(128)
  -- A grid of points, joined by triangles.
  local angles, rings = sight.ANGLES, sight.RINGS
  cone = g.newMesh(
    { { "VertexPosition", "float", 2 }, { "VertexColor", "float", 4 } },
    angles * rings, "triangles", "stream"
  )
  local map = {}
  for a = 0, angles - 2 do
    for r = 0, rings - 2 do
      local first = a * rings + r + 1
      local n = #map
      map[n + 1], map[n + 2], map[n + 3] = first, first + 1, first + rings
      map[n + 4], map[n + 5], map[n + 6] = first + 1, first + rings + 1, first + rings
    end
  end
  cone:setVertexMap(map)
  vertices = love.data.newByteData(angles * rings * 6 * 4)
end

local function add_cone(game, guard)
  local out = ffi.cast("float*", vertices:getFFIPointer())
  local colour = guard.seen > 0 and DANGER or LANTERN
  sight.cone(game.scene, guard.x, guard.z, guard.heading, function(a, r, x, z, value)
    local at = 6 * (a * sight.RINGS + r)
    out[at], out[at + 1] = x * draw.SCALE, z * draw.SCALE
    out[at + 2], out[at + 3], out[at + 4], out[at + 5] = colour[1] * value, colour[2] * value, colour[3] * value, 1
  end)
  cone:setVertices(vertices)
  g.draw(cone)
end

local function add_glow(x, z, radius, colour, strength)
  local scale = 2 * radius * draw.SCALE / glow:getWidth()
  g.setColor(colour[1] * strength, colour[2] * strength, colour[3] * strength)
  g.draw(glow, x * draw.SCALE, z * draw.SCALE, 0, scale, scale, glow:getWidth() / 2, glow:getHeight() / 2)
  g.setColor(1, 1, 1)
end

local function light_hall(game)
  local target = g.getCanvas()
  g.setCanvas(light)
  g.clear(NIGHT[1], NIGHT[2], NIGHT[3], 1)
  g.setBlendMode("add", "premultiplied")
  for _, guard in ipairs(game.guards) do
    add_cone(game, guard)
    add_glow(guard.x, guard.z, 1.4, guard.seen > 0 and DANGER or LANTERN, 0.8)
  end
  add_glow(game.x, game.z, 2.2, PLAYER, 0.45)
  for _, gem in ipairs(game.gems) do
    if not gem.taken then add_glow(gem.x, gem.z, 1.8, GEM, 0.7 + 0.2 * math.sin(4 * game.time + gem.x)) end
  end
  add_glow(game.exit_x, game.exit_z, 3, EXIT, game:gems_left() == 0 and 1.1 or 0.25)
  g.setBlendMode("alpha")
  g.setCanvas(target)
end

local function gem_shape(x, y, size, colour, mode)
  g.setColor(colour)
  g.polygon(mode, x, y - size, x + 0.75 * size, y, x, y + size, x - 0.75 * size, y)
end

local function person(x, z, colour, heading)
  local px, py, r = x * draw.SCALE, z * draw.SCALE, museum.BODY * draw.SCALE
  g.setColor(0, 0, 0, 0.5)
  g.circle("fill", px, py, r + 3)
  if heading then
    local c, s = math.cos(heading), math.sin(heading)
    g.polygon("fill", px + (r + 9) * c, py + (r + 9) * s, px - r * s, py + r * c, px + r * s, py - r * c)
    g.setColor(colour)
    g.polygon("fill", px + (r + 6) * c, py + (r + 6) * s, px - 0.8 * r * s, py + 0.8 * r * c, px + 0.8 * r * s,
      py - 0.8 * r * c)
  end
  g.setColor(colour)
  g.circle("fill", px, py, r)
  g.setColor(1, 1, 1, 0.85)
  g.circle("line", px, py, r)
end

local function draw_people(game)
  for _, gem in ipairs(game.gems) do
    if not gem.taken then
      gem_shape(gem.x * draw.SCALE, gem.z * draw.SCALE, 10, GEM, "fill")
      gem_shape(gem.x * draw.SCALE, gem.z * draw.SCALE, 10, { 1, 1, 1, 0.8 }, "line")
    end
  end
  local open = game:gems_left() == 0
  local x, y = game.exit_x * draw.SCALE, game.exit_z * draw.SCALE
  g.setColor(EXIT[1], EXIT[2], EXIT[3], open and 1 or 0.45)
  g.rectangle("line", x - 22, y - 15, 44, 30, 5)
  g.setFont(font(15))
  g.printf("EXIT", x - 22, y - 9, 44, "center")
  for _, guard in ipairs(game.guards) do
    person(guard.x, guard.z, guard.seen > 0 and DANGER or LANTERN, guard.heading)
    if guard.seen > 0 then
      g.setColor(DANGER)
      g.setFont(font(24))
      g.printf("!", guard.x * draw.SCALE - 20, guard.z * draw.SCALE - 42, 40, "center")
    end
  end
  person(game.x, game.z, PLAYER)
end

local function draw_bar(game, rays, milliseconds)
  g.setColor(0.07, 0.075, 0.1)
  g.rectangle("fill", 0, 0, draw.WIDTH, draw.BAR)
  g.setFont(font(22))
  g.setColor(1, 1, 1)
  g.print("Statues", 14, 9)
  for i, gem in ipairs(game.gems) do
    gem_shape(132 + 26 * i, draw.BAR / 2, 10, GEM, gem.taken and "fill" or "line")
  end
  g.setFont(font(15))
  g.setColor(0.8, 0.82, 0.86)
  g.print("alarm", 262, 13)
  g.setColor(0.22, 0.23, 0.28)
  g.rectangle("fill", 312, 15, 180, 14, 4)
  if game.alarm > 0 then
    g.setColor(DANGER)
    g.rectangle("fill", 312, 15, 180 * game.alarm, 14, 4)
  end
  g.setColor(0.8, 0.82, 0.86)
  local hint = game:gems_left() > 0 and "Take the gems. Stay out of the light." or "Now to the exit."
  g.print(hint, 514, 13)
  g.setColor(0.56, 0.59, 0.66)
  local cost = milliseconds and (", %.1f ms"):format(milliseconds) or ""
  g.printf(("arrows or WASD   R again   Esc leave   %d rays a frame%s"):format(rays, cost), 0, 13, draw.WIDTH - 14, "right")
end

local function draw_end(title, line, colour)
  g.setColor(0.02, 0.025, 0.04, 0.62)
  g.rectangle("fill", 0, draw.BAR, draw.WIDTH, draw.HALL)
  local y = draw.BAR + draw.HALL / 2
  g.setColor(colour)
  g.setFont(font(64))
  g.printf(title, 0, y - 76, draw.WIDTH, "center")
  g.setColor(1, 1, 1)
  g.setFont(font(22))
  g.printf(line, 0, y + 14, draw.WIDTH, "center")
end

-- Draws a frame of WIDTH x HEIGHT. `clock` is a function that returns seconds, or nil: then no times are shown.
function draw.frame(game, clock)
  local asked, start = nif.asked, clock and clock()
  light_hall(game)
  local rays = nif.asked - asked
  local milliseconds = clock and 1000 * (clock() - start)
  g.setColor(1, 1, 1)
  shader:send("light", light)
  g.setShader(shader)
  g.draw(hall, 0, draw.BAR)
  g.setShader()
  g.push()
  g.translate(0, draw.BAR)
  g.setColor(0.07, 0.075, 0.1)
  g.setLineWidth(8)
  g.rectangle("line", 0, 0, draw.WIDTH, draw.HALL)
  g.setLineWidth(1.5)
  draw_people(game)
  g.pop()
  draw_bar(game, rays, milliseconds)
  if game.state == "caught" then
    draw_end("Caught", "A guard has seen enough of you. Press R to try again.", DANGER)
  elseif game.state == "won" then
    draw_end("You are out", ("With all gems, in %d seconds. Press R to play again."):format(game.time), EXIT)
  end
  g.setColor(1, 1, 1)
end

-- Shown while the hall is painted.
function draw.loading(done, text)
  g = love.graphics
  fonts = fonts or {}
  g.clear(0.07, 0.075, 0.1)
  g.setFont(font(22))
  g.setColor(1, 1, 1)
  g.printf("Statues", 0, draw.HEIGHT / 2 - 64, draw.WIDTH, "center")
  g.setFont(font(15))
  g.setColor(0.7, 0.72, 0.78)
  g.printf(text, 0, draw.HEIGHT / 2 + 26, draw.WIDTH, "center")
  g.setColor(0.22, 0.23, 0.28)
  g.rectangle("fill", draw.WIDTH / 2 - 200, draw.HEIGHT / 2, 400, 10, 4)
  g.setColor(PLAYER)
  g.rectangle("fill", draw.WIDTH / 2 - 200, draw.HEIGHT / 2, 400 * done, 10, 4)
  g.setColor(1, 1, 1)
end

return draw
