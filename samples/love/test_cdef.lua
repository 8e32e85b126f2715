-- Compares nif_cdef.lua with nif.h; run by luajit. A C program, generated from the declarations and compiled against the header,
-- prints sizes, offsets and numbers, which must be those that the FFI uses. The program also declares the functions again, so
-- that a type that differs from the header's is a compiler error.
--
--   luajit test_cdef.lua FOLDER_OF_INCLUDES SCRATCH_FOLDER [CC]
local ffi = require("ffi")
local folder = arg[0]:match("^(.*)/") or "."
package.path = package.path .. ";" .. folder .. "/?.lua" -- a test may put another nif_cdef.lua in front with LUA_PATH
local text = require("nif_cdef")
ffi.cdef(text)
local includes, scratch, cc = arg[1], arg[2], arg[3] or "cc"

local structures, enumerators, functions, enums = {}, {}, {}, {}
for name, body in text:gmatch("typedef struct (%w+) (%b{})") do
  local fields = {}
  for field in body:gmatch("([%w_]+)%s*%[?%d*%]?;") do fields[#fields + 1] = field end
  structures[#structures + 1] = { name = name, fields = fields, body = body }
end
for name, body in text:gmatch("typedef enum (%w+) (%b{})") do
  enums[#enums + 1] = name
  for enumerator in body:gmatch("(NIF_[%w_]+) =") do enumerators[#enumerators + 1] = { enum = name, name = enumerator } end
end
for line in text:gmatch("[^\n]+") do
  if line:match("^[%w_%s%*]+nif%w+%(.*%);$") then functions[#functions + 1] = line end
end
assert(#structures > 0 and #enumerators > 0 and #functions > 0, "nif_cdef.lua has no declarations that this test can read")

-- The FFI's view: name of a fact, and its number.
local mine, lines = {}, {}
local function fact(name, number, c)
  mine[#mine + 1] = ("%s %d"):format(name, number)
  lines[#lines + 1] = ('  printf("%s %%ld\\n", (long)(%s));'):format(name, c)
end
local copies = {}
for _, structure in ipairs(structures) do
  local s = structure.name
  copies[#copies + 1] = ("struct copy_of_%s %s;"):format(s, structure.body)
  fact("sizeof " .. s, ffi.sizeof(s), ("sizeof(%s)"):format(s))
  for _, field in ipairs(structure.fields) do
    fact(("offset %s.%s"):format(s, field), ffi.offsetof(s, field), ("offsetof(%s, %s)"):format(s, field))
    fact(("same type %s.%s"):format(s, field), 1,
      ("__builtin_types_compatible_p(__typeof__(((%s*)0)->%s), __typeof__(((struct copy_of_%s*)0)->%s))")
        :format(s, field, s, field))
  end
end
for _, e in ipairs(enumerators) do
  fact("number " .. e.name, tonumber(ffi.cast("int64_t", ffi.new(e.enum, e.name))), e.name)
end
for _, name in ipairs(enums) do fact("sizeof " .. name, ffi.sizeof(name), ("sizeof(%s)"):format(name)) end

local function write(name, content)
  local file = assert(io.open(name, "w"))
  file:write(content)
  file:close()
end
write(scratch .. "/cdef.c", table.concat({
  "#include <nif/nif.h>", "#include <stddef.h>", "#include <stdio.h>",
  table.concat(functions, "\n"), table.concat(copies, "\n"),
  "int main(void) {", table.concat(lines, "\n"), "  return 0;", "}", "",
}, "\n"))
local compile = ("%s -std=gnu11 -Wall -Werror -I '%s' '%s/cdef.c' -o '%s/cdef'"):format(cc, includes, scratch, scratch)
if os.execute(compile) ~= 0 then
  io.stderr:write("test_cdef.lua: nif.h declares it otherwise; see the compiler's message\n")
  os.exit(1)
end
local pipe = assert(io.popen(scratch .. "/cdef"))
local wrong, at = 0, 0
for line in pipe:lines() do
  at = at + 1
  if line ~= mine[at] then
    io.stderr:write(("test_cdef.lua: nif.h says '%s', nif_cdef.lua '%s'\n"):format(line, tostring(mine[at])))
    wrong = wrong + 1
  end
end
pipe:close()
if at ~= #mine then
  io.stderr:write(("test_cdef.lua: %d facts of %d\n"):format(at, #mine))
  wrong = wrong + 1
end
print(("nif_cdef.lua: %d functions and %d sizes, offsets, types and numbers are as in nif.h"):format(#functions, #mine - wrong))
os.exit(wrong == 0 and 0 or 1)
