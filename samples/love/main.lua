-- Statues: a small game for LÖVE in which nifkit answers every question about visibility, through LuaJIT's FFI. README.md says
-- how to start it.
local options = { up = "y" }
local nif, museum, Game, draw -- loaded once the library is
local asset, scene, game, painter, hall, canvas, script, shot
local done, time, broken = 0, 0, nil

local USAGE = "love samples/love --asset FILE.nif [--library libnif.so] [--up y|z] [--script FILE]"

-- Reports an error and exits with 1; also in a window, if there may be somebody to see it.
local function fail(text)
  io.stderr:write("statues: ", text, "\n")
  if script or options.script or love.window == nil then
    love.event.quit(1)
    return
  end
  love.window.setMode(760, 240)
  love.window.setTitle("Statues")
  broken = text
end

local function read_options(arguments)
  local i = 1
  while i <= #arguments do
    local name = arguments[i]:match("^%-%-(%a+)$")
    if name ~= "asset" and name ~= "library" and name ~= "up" and name ~= "script" then
      return nil, ("unknown option '%s'; usage: %s"):format(arguments[i], USAGE)
    end
    if not arguments[i + 1] then return nil, ("--%s takes a value; usage: %s"):format(name, USAGE) end
    options[name] = arguments[i + 1]
    i = i + 2
  end
  if options.up ~= "y" and options.up ~= "z" then return nil, "--up takes y or z" end
  if not options.asset then return nil, "there is no asset; usage: " .. USAGE end
  return true
end

-- Loads everything that can be missing. Returns true, or nil and a sentence.
local function prepare(arguments)
  local fine, why = read_options(arguments)
  if not fine then return nil, why end
  nif = require("nif")
  fine, why = nif.load(options.library)
  if not fine then return nil, why .. ". Build and start everything with samples/love/run.sh, or name the library with --library." end
  museum, Game, draw = require("museum"), require("game"), require("draw")
  local device
  device, why = nif.device(0)
  if not device then return nil, why end
  asset, why = device:load(options.asset)
  if not asset then return nil, why end
  scene, why = museum.build(device, asset, options.up)
  if not scene then return nil, ("%s: %s"):format(options.asset, why) end
  if options.script then
    local file
    file, why = io.open(options.script, "r")
    if not file then return nil, "cannot read " .. why end
    script, why = require("script").new(file:read("*a"), options.script)
    file:close()
    if not script then return nil, why end
  end
  return true
end

function love.load(arguments)
  local fine, why = prepare(arguments)
  if not fine then return fail(why) end
  love.window.setMode(draw.WIDTH, draw.HEIGHT, { resizable = true, minwidth = 640, minheight = 374, vsync = script and 0 or 1 })
  love.window.setTitle("Statues")
  canvas = love.graphics.newCanvas(draw.WIDTH, draw.HEIGHT)
  hall = love.image.newImageData(draw.WIDTH, draw.HALL)
  local pixels = require("ffi").cast("uint8_t*", hall:getFFIPointer())
  painter = require("picture").painter(scene, pixels, draw.WIDTH, draw.HALL, draw.SCALE)
end

local function start()
  game, time = Game.new(scene), 0
end

-- Paints for a thirtieth of a second.
local function paint()
  local from = love.timer.getTime()
  repeat
    done = painter()
  until done >= 1 or love.timer.getTime() - from > 1 / 30
  if done >= 1 then
    painter = nil
    draw.load(hall)
    start()
  end
end

-- Whether one of these keys is down, or held by the script.
local held
local function down(...)
  if not script then return love.keyboard.isDown(...) and 1 or 0 end
  for _, key in ipairs({ ... }) do
    if key == held then return 1 end
  end
  return 0
end

-- The direction given by the keys: x and z.
local function wish()
  return down("right", "d") - down("left", "a"), down("down", "s") - down("up", "w")
end

local function pressed(key)
  if key == "escape" then love.event.quit(0) end
  if key == "r" and game then start() end
end

-- The script plays until a picture has to be drawn, for at most a tenth of a second.
local function play_script()
  local from = love.timer.getTime()
  while not shot and love.timer.getTime() - from < 0.1 do
    local what, value = script:next(game, Game.STEP)
    if what == nil then return fail(value) end
    if what == "end" then return love.event.quit(0) end
    if what == "shot" then
      shot = value
    elseif what == "press" then
      pressed(value)
    elseif what == "hold" then
      held = value
      game:step(wish())
      held = nil
    else
      game:step(what, value)
    end
  end
end

function love.update(dt)
  if broken or not scene then return end
  if painter then return paint() end
  if script then return play_script() end
  time = math.min(time + dt, 0.25)
  while time >= Game.STEP do
    time = time - Game.STEP
    game:step(wish())
  end
end

-- Writes what the window shows; captureScreenshot itself can only write into LÖVE's own folder.
local function save(path)
  love.graphics.captureScreenshot(function(image)
    local file, why = io.open(path, "wb")
    local fine = file ~= nil
    if file then
      fine, why = file:write(image:encode("png"):getString())
      fine = file:close() and fine
    end
    if not fine then fail("cannot write " .. (why or path)) end
  end)
end

function love.draw()
  local g = love.graphics
  if broken then
    g.clear(0.07, 0.075, 0.1)
    g.printf(broken .. "\n\nPress any key.", 30, 40, 700, "left")
    return
  end
  if not canvas then return end
  g.setCanvas(canvas)
  if game then
    -- A script's pictures do not show times, so that they are always the same.
    draw.frame(game, not script and love.timer.getTime or nil)
  else
    draw.loading(done, "painting the hall, by rays through the asset")
  end
  g.setCanvas()
  local width, height = g.getDimensions()
  local scale = math.min(width / draw.WIDTH, height / draw.HEIGHT)
  g.clear(0, 0, 0)
  g.setBlendMode("alpha", "premultiplied")
  g.draw(canvas, (width - scale * draw.WIDTH) / 2, (height - scale * draw.HEIGHT) / 2, 0, scale, scale)
  g.setBlendMode("alpha")
  if shot then
    save(shot)
    shot = nil
  end
end

function love.keypressed(key)
  if broken then return love.event.quit(1) end
  if not script then pressed(key) end
end
