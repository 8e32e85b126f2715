-- A scripted player, for tests: one command per line.
--
--   walk COLUMN ROW     goes straight to the centre of that cell, sliding along statues
--   wait SECONDS        stands still
--   at SECONDS          stands still until that time of the game
--   hold KEY SECONDS    holds that key, e.g. left or a
--   press KEY           presses that key, e.g. r
--   expect WORD         ends with an error unless the game is in this state: playing, won, caught, seen or unseen
--   near COLUMN ROW     ends with an error unless the player is in that cell
--   gems NUMBER         ends with an error unless this number is left
--   until WORD SECONDS  stands still until the game is in that state; an error if it takes longer
--   shot FILE           writes a picture of the next frame (PNG)
-- Blank lines, and text after #, are ignored. After the last line, the game ends.
local museum = require("museum")

local script = {}
script.__index = script

local WORDS = { playing = true, won = true, caught = true, seen = true, unseen = true }

local function is(game, word)
  if word == "seen" then return (game.seen or 0) > 0 end
  if word == "unseen" then return (game.seen or 0) == 0 end
  return game.state == word
end

-- Reads the text of a script. Returns it, or nil and a sentence that names the line.
function script.new(text, name)
  local commands, number = {}, 0
  for line in (text .. "\n"):gmatch("(.-)\r?\n") do
    number = number + 1
    local words = {}
    for word in line:gsub("#.*", ""):gmatch("%S+") do words[#words + 1] = word end
    local verb, a, b = words[1], words[2], words[3]
    local fine = ({
      walk = #words == 3 and tonumber(a) and tonumber(b) and museum.at(tonumber(a), tonumber(b)),
      near = #words == 3 and tonumber(a) and tonumber(b),
      wait = #words == 2 and tonumber(a),
      at = #words == 2 and tonumber(a),
      hold = #words == 3 and tonumber(b),
      press = #words == 2,
      expect = #words == 2 and WORDS[a],
      gems = #words == 2 and tonumber(a),
      ["until"] = #words == 3 and WORDS[a] and tonumber(b),
      shot = #words == 2,
    })[verb]
    if verb and not fine then return nil, ("%s, line %d: cannot read '%s'"):format(name, number, line) end
    if verb then commands[#commands + 1] = { verb = verb, a = a, b = b, line = number } end
  end
  return setmetatable({ commands = commands, at = 1, name = name, steps = 0 }, script)
end

local function failed(self, command, text)
  return nil, ("%s, line %d: %s"):format(self.name, command.line, text)
end

-- What to do next. Returns the movement wanted in the next step of the game, dx and dz; or "hold" and a key, for the next step;
-- or "press" and a key; or "shot" and a file; or "end"; or nil and a sentence. `step` is the length of a step in seconds.
function script:next(game, step)
  while true do
    local command = self.commands[self.at]
    if not command then return "end" end
    local verb, a, b = command.verb, command.a, command.b
    self.steps = self.steps + 1
    local seconds = (self.steps - 1) * step
    if verb == "walk" and game.state == "playing" then
      local x, z = museum.centre(tonumber(a), tonumber(b))
      local dx, dz = x - game.x, z - game.z
      if dx * dx + dz * dz > 0.01 then
        if seconds > 30 then return failed(self, command, ("cannot get to %s %s"):format(a, b)) end
        return dx, dz
      end
    elseif verb == "wait" and seconds < tonumber(a) then
      return 0, 0
    elseif verb == "at" and game.state == "playing" and game.time < tonumber(a) - step / 2 then
      return 0, 0
    elseif verb == "hold" and seconds < tonumber(b) then
      return "hold", a
    elseif verb == "until" and not is(game, a) then
      if seconds < tonumber(b) then return 0, 0 end
      return failed(self, command, ("not %s within %s s"):format(a, b))
    elseif verb == "expect" and not is(game, a) then
      return failed(self, command, ("expected %s; it is %s"):format(a, game.state))
    elseif verb == "near" then
      local column, row = museum.cell_of(game.x, game.z)
      if column ~= tonumber(a) or row ~= tonumber(b) then
        return failed(self, command, ("expected the player in cell %s %s, not %d %d"):format(a, b, column, row))
      end
    elseif verb == "gems" and game:gems_left() ~= tonumber(a) then
      return failed(self, command, ("expected %s gems; there are %d"):format(a, game:gems_left()))
    end
    self.at, self.steps = self.at + 1, 0
    if verb == "shot" or verb == "press" then return verb, a end
  end
end

return script
