-- No window yet: main.lua opens one once the library and the asset are loaded.
function love.conf(t)
  t.identity = "nifkit-statues"
  t.version = "11.4"
  t.window = nil
  t.modules.audio, t.modules.sound, t.modules.physics, t.modules.joystick = false, false, false, false
  t.modules.touch, t.modules.video = false, false
end
