-- No window yet: main.lua opens one when it knows that the library and the asset are there.
function love.conf(t)
  t.identity = "nifkit-statues"
  t.version = "11.4"
  t.window = nil
  t.modules.audio, t.modules.sound, t.modules.physics, t.modules.joystick = false, false, false, false
  t.modules.touch, t.modules.video = false, false
end
