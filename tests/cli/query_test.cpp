// `nif query`: rays and answers in each form, and errors in either.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/program.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

/// An exact asset with two objects: a square from 0 to 1 at z = 0, and the same at z = 10.
class Query : public testing::Test {
 protected:
  static constexpr const char* kDown = "0.25 0.5 2 0 0 -1";       // meets the first
  static constexpr const char* kShort = "0.25 0.5 2 0 0 -1 0 1";  // ends before it
  static constexpr const char* kAside = "3 3 2 0 0 -1";

  static void SetUpTestSuite() {
    folder_ = new TempDir;
    std::string text;
    int base = 1;
    for (const int z : {0, 10}) {
      text += "o square" + std::to_string(z) + "\n";
      for (const char* at : {"0 0 ", "1 0 ", "1 1 ", "0 1 "})
        text += std::string("v ") + at + std::to_string(z) + "\n";
      const auto v = [&](int i) { return " " + std::to_string(base + i); };
      text += "f" + v(0) + v(1) + v(2) + "\nf" + v(0) + v(2) + v(3) + "\n";
      base += 4;
    }
    const std::string mesh = folder_->write("squares.obj", text).string();
    asset_ = new std::string((folder_->path() / "squares.nif").string());
    // The squares differ in z, so the file has two objects, not two instances of one.
    const Outcome outcome =
        nif({"bake", mesh, "-o", *asset_, "--encoding", "bvh", "--rays", "0", "--quiet", "--no-merge"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  }
  static void TearDownTestSuite() {
    delete folder_;
    delete asset_;
  }

  static Outcome query(std::vector<std::string> more) {
    more.insert(more.begin(), {"query", *asset_});
    return nif(more);
  }
  static Outcome rays(const std::string& bytes, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"--rays", folder_->write("rays", bytes).string()});
    return query(more);
  }
  /// Runs it with standard input from a pipe.
  static Outcome piped(const std::string& bytes, const std::string& options = "") {
    const std::string file = folder_->write("rays", bytes).string();
    return Process("/bin/sh", {"-c", R"(cat "$1" | "$0" query "$2" --rays - )" + options, nif_path().string(),
                               file, *asset_})
        .finish();
  }
  /// One digit per ray: 1 is visible.
  static std::string visible(const Outcome& outcome) {
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(without_progress(outcome.err).empty()) << outcome.err;
    std::string digits;
    for (const std::string& line : lines_of(outcome.out))
      if (line != "visible,certain,probability") digits += line.substr(0, 1);
    return digits;
  }
  static void expect_refused(const Outcome& outcome, Status status, const std::string& why) {
    EXPECT_EQ(outcome.code, int(status)) << outcome.err;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << why << " in:\n" << outcome.err;
    EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
  }

  static TempDir* folder_;
  static std::string* asset_;
};
TempDir* Query::folder_;
std::string* Query::asset_;

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string npy(const std::string& header, const std::string& elements, int version = 1) {
  std::string length = bytes_of(std::vector<uint32_t>{uint32_t(header.size())});
  return "\x93NUMPY" + std::string{char(version), '\0'} + length.substr(0, version == 1 ? 2 : 4) + header +
         elements;
}
std::string npy_of(const std::string& type, const std::string& shape, const std::string& elements,
                   bool by_columns = false) {
  return npy("{'descr': '" + type + "', 'fortran_order': " + (by_columns ? "True" : "False") +
                 ", 'shape': " + shape + ", }          \n",
             elements);
}

TEST_F(Query, AnswersRaysOfTheCommandLine) {
  const Outcome outcome = query({"--ray", kDown, "--ray", kShort, "--ray", "0.25,0.5,2, 0,0,-1"});
  EXPECT_EQ(outcome.out, "visible,certain,probability\n0,1,0\n1,1,1\n0,1,0\n") << outcome.err;
  EXPECT_EQ(outcome.err, "");
  // A direction to another point with tmax 1: does this point see that one?
  EXPECT_EQ(visible(query({"--ray", "0.5 0.5 1  0 0 -2  0 1", "--ray", "2 0.5 1  0 0 -2  0 1"})), "01");
  // Values that look like options.
  EXPECT_EQ(
      visible(query({"--ray", "-.5 0.5 0.25 1 0 -.25", "--ray", "-1 0 2 0 0 -1", "--ray=-inf 0 0 0 0 1"})),
      "011");
}

TEST_F(Query, TellsWhereRaysHit) {
  const Outcome csv = query({"--ray", kDown, "--ray", kAside, "--hits"});
  EXPECT_EQ(csv.out,
            "visible,certain,probability,t,nx,ny,nz,instance,object,triangle\n"
            "0,1,0,2,0,0,1,0,0," +
                csv.out.substr(csv.out.find("\n0,1,0,2,0,0,1,0,0,") + 19, 1) + "\n1,1,1,,,,,,,\n")
      << csv.err;
  const Outcome lines = query({"--ray", kDown, "--ray", kAside, "--hits", "--format", "jsonl"});
  ASSERT_EQ(lines_of(lines.out).size(), 2u) << lines.err;
  const json hit = json::parse(lines_of(lines.out)[0]), miss = json::parse(lines_of(lines.out)[1]);
  EXPECT_EQ(hit["visible"], false);
  EXPECT_EQ(hit["certain"], true);
  EXPECT_EQ(hit["t"], 2);
  EXPECT_EQ(hit["nz"], 1);
  EXPECT_EQ(hit["instance"], 0);
  EXPECT_TRUE(hit["triangle"].is_number());
  EXPECT_EQ(miss["visible"], true);
  for (const char* field : {"t", "nx", "ny", "nz", "instance", "object", "triangle"})
    EXPECT_TRUE(miss.at(field).is_null()) << field;
}

TEST_F(Query, AsksOneObjectAlone) {
  const std::string up = "0.5 0.5 1 0 0 1";
  EXPECT_EQ(visible(query({"--ray", up})), "0");
  EXPECT_EQ(visible(query({"--ray", up, "--object", "0"})), "1");
  expect_refused(query({"--ray", up, "--object", "2"}), Status::usage, "--object 2: " + *asset_ + " has ");
}

TEST_F(Query, ReadsTables) {
  const std::string down = "0.25,0.5,2,0,0,-1", aside = "3,3,2,0,0,-1";
  const std::string both = down + "\n" + aside + "\n";
  EXPECT_EQ(visible(rays(both)), "01");
  EXPECT_EQ(visible(rays(down + "\n" + aside)), "01");
  EXPECT_EQ(visible(rays("\xef\xbb\xbf# rays\r\n\r\n" + down + " # the first\r\n" + aside + "\r\n")), "01");
  EXPECT_EQ(visible(rays(down + "\r" + aside + "\r")), "01");
  EXPECT_EQ(visible(rays("0.25;0.5;2;0;0;-1;0;1\n3 ; 3;2;0;0;-1;;\n0.25;0.5;2;0;0;-1;0;\n")), "110");
  EXPECT_EQ(visible(rays("0.25\t0.5\t2\t0\t0\t-1\n  3 3  2 0 0 -1  \n")), "01");
  EXPECT_EQ(visible(rays("tmax,dz,dy,dx,oz,oy,ox\n1,-1,0,0,2,0.5,0.25\n3,-1,0,0,2,0.5,0.25\n")), "10");
  EXPECT_EQ(visible(rays("\"ox\",\"oy\",\"oz\",\"dx\",\"dy\",\"dz\"\n" + both)), "01");
  EXPECT_EQ(visible(piped(both)), "01");
  EXPECT_EQ(visible(piped("")), "");
  EXPECT_EQ(visible(rays("ox oy oz dx dy dz\n")), "");
  EXPECT_EQ(rays("\n# nothing\n").out, "visible,certain,probability\n");
}

/// The ray ends in the square, or one step of a float before it.
TEST_F(Query, ReadsNumbersToTheLastBit) {
  const std::string ray = "0x1p-2 0X.8p0 2 0 0 -1 0 ";
  EXPECT_EQ(
      visible(rays(ray + "2\n" + ray + "1.9999999\n" + ray + "0x1.fffffep0\n" + ray + "0x1.ffffffp0\n")),
      "0110");
  // Halfway between two floats, and a little more: rounded once.
  EXPECT_EQ(visible(rays(ray + "1.99999994039535522460937500000000000000001\n")), "0");
  EXPECT_EQ(visible(rays(ray + "inf\n" + ray + "+Infinity\n" + ray + "1e999\n" + ray + "-1e999\n" + ray +
                         "nan\n" + ray + "1e-999\n" + ray + "-nan\n")),
            "0001111");
}

TEST_F(Query, ReadsJsonLines) {
  EXPECT_EQ(visible(rays(R"({"origin": [0.25, 0.5, 2], "direction": [0, 0, -1]}
{"tmax":1,"direction":[0,0,-1],"tmin":0,"origin":[0.25,0.5,2]}
[0.25, 0.5, 2, 0, 0, -1]
# a comment
[0.25,0.5,2,0,0,-1,"0x0p0","0x1p0"]
 {"origin":[0.25,0.5,2],"direction":[0,0,-1],"tmin":null,"tmax":Infinity}
[NaN,0,0,0,0,1]
)")),
            "010101");
  for (const auto& [text, why] : std::vector<std::pair<std::string, std::string>>{
           {"[1,2,3]", "6 or 8 numbers is needed, and there are 3"},
           {"[1,2,3,4,5,6", "']' is needed before the end of the line"},
           {"[[1,2,3,4,5,6]]", "array [0]: '[1' is not a number"},
           {"[1,2,3,4,5,6] 7", "'7' follows the ray"},
           {"{\"origin\":[1,2,3]}", "there is no 'direction'"},
           {"{\"origin\":[1,2,3],\"direction\":[1,2]}", "direction has 2 numbers instead of 3"},
           {"{\"origin\":[1,2,3],\"origin\":[1,2,3]}", "'origin' occurs twice"},
           {"{\"origin\":[1,2,x]}", "origin [2]: 'x' is not a number"},
           {"{\"o\":[1,2,3]}", "'o' is not one of the keys"},
           {"{\"origin", "a string does not end"},
           {"{}", "there is no 'origin'"},
           {"{", "'\"' is needed before the end of the line"},
           {"{" + std::string(1000, '['), "a key is a string"}})
    expect_refused(rays("[1,2,3,4,5,6]\n" + text + "\n"), Status::malformed_rays, why);
}

TEST_F(Query, ReadsArrays) {
  const std::vector<float> both{0.25, 0.5, 2, 0, 0, -1, 3, 3, 2, 0, 0, -1};
  EXPECT_EQ(visible(rays(npy_of("<f4", "(2, 6)", bytes_of(both)))), "01");
  const std::vector<double> doubles(both.begin(), both.end());
  EXPECT_EQ(visible(rays(npy_of("<f8", "(2, 6)", bytes_of(doubles)))), "01");
  std::string swapped;
  for (const double value : doubles) {
    std::string bytes = bytes_of(std::vector<double>{value});
    swapped.append(bytes.rbegin(), bytes.rend());
  }
  EXPECT_EQ(visible(rays(npy_of(">f8", "(2, 6)", swapped))), "01");
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<float> columns{0.25, 0.25, 3, 0.5, 0.5, 3,  2, 2, 2, 0, 0,   0,
                                   0,    0,    0, -1,  -1,  -1, 0, 0, 0, 1, inf, 2};
  const std::string by_columns = npy_of("<f4", "(3, 8)", bytes_of(columns), true);
  EXPECT_EQ(visible(rays(by_columns)), "101");
  EXPECT_EQ(visible(piped(by_columns)), "101");
  EXPECT_EQ(visible(piped(npy_of("<f4", "(2, 6)", bytes_of(both)))), "01");
  EXPECT_EQ(visible(rays(npy_of("<f4", "(0, 8)", ""))), "");
  EXPECT_EQ(visible(rays(npy_of("<f4", "(6,)", bytes_of(both).substr(0, 24)))), "0");
  for (const int version : {2, 3})
    EXPECT_EQ(visible(rays(npy("{\"shape\": (2L, 6L), 'fortran_order': False, 'descr': '=f4'}",
                               bytes_of(both), version))),
              "01");
}

TEST_F(Query, RefusesArraysByName) {
  const std::string six(24, '\0');
  using Case = std::tuple<std::string, Status, std::string>;
  for (const auto& [bytes, status, why] : std::vector<Case>{
           {npy_of("<f4", "(2, 6)", six), Status::file_truncated, "ends in row 2 of the 2"},
           {npy_of("<f4", "(1, 6)", six + "x"), Status::malformed_rays, "continues after the 1 rows"},
           {npy_of("<f4", "(9999999999999, 6)", six), Status::file_truncated,
            "ends in row 2 of the 9999999999999"},
           {npy_of("<f4", "(99999999999999999999, 6)", six), Status::malformed_rays, "larger than any file"},
           {npy_of("<f4", "(2, 3)", six), Status::malformed_rays, "its shape is 2 x 3"},
           {npy_of("<f4", "()", six), Status::malformed_rays, "its shape is that of one number"},
           {npy_of("<f4", "(1, 2, 3)", six), Status::malformed_rays, "its shape is 1 x 2 x 3"},
           {npy_of("<f4", "(-1, 6)", six), Status::malformed_rays, "no tuple of numbers"},
           {npy_of("<i8", "(1, 6)", six), Status::malformed_rays, "its elements are '<i8'"},
           {npy("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (1, 6)}", six),
            Status::malformed_rays, "array of structures"},
           {npy("{'descr': '<f4', 'shape': (1, 6)}", six), Status::malformed_rays, "lacks"},
           {npy("{'descr': '<f4', 'descr': '<f4'}", six), Status::malformed_rays, "'descr', or has it twice"},
           {npy("{'descr': '<f4", six), Status::malformed_rays, "a string does not end"},
           {npy("{'fortran_order': Maybe}", six), Status::malformed_rays, "neither True nor False"},
           {npy("", six), Status::malformed_rays, "'{' is needed"},
           {npy("{}", six, 4), Status::malformed_rays, ".npy version 4"},
           {std::string("\x93NUMPY\x02\x00\xff\xff\xff\xff", 12), Status::malformed_rays,
            "a header of 4294967295 bytes"},
           {"\x93NUMPY", Status::file_truncated, "ends within its header"}}) {
    expect_refused(rays(bytes), status, why);
  }
  // The size of a pipe is not known in advance.
  expect_refused(piped(npy_of("<f4", "(9999999999999, 6)", six)), Status::file_truncated, "ends in row 2 of");
  expect_refused(piped(npy_of("<f4", "(1, 6)", six + "x")), Status::malformed_rays,
                 "continues after the 1 rows");
  const std::string by_columns = npy_of("<f4", "(9999999999999, 6)", six, true);
  expect_refused(piped(by_columns), Status::file_truncated,
                 "standard input: ends in row 1 of the 9999999999999");
}

TEST_F(Query, RefusesTablesByLineAndColumn) {
  const std::string ray = "1 2 3 4 5 6\n";
  for (const auto& [text, why] : std::vector<std::pair<std::string, std::string>>{
           {ray + "\r\n" + ray + "1 2 3 4 x 6\n", "line 4: column 5 (dy): 'x' is not a number"},
           {ray + "1 2 3 4 5\n", "line 2: there are 5 numbers, but the first ray has 6"},
           {ray + "1 2 3 4 5 6 7 8\n", "line 2: there are 8 numbers"},
           {"1 2 3 4 5\n", "line 1: a ray has 6 or 8 numbers"},
           {"1,2,3,4,5,6,\n", "and there are 7"},
           {"0,5;0;0;1;0;0\n", "'0,5' is neither a number nor the name of a column"},
           {"ox,oy,oz,dx,dy,dz\n1,2,3,4,5,6,7\n", "line 2: there are 7 numbers, but the header has 6"},
           {"ox,oy,oz,dx,dy,dz,w\n", "'w' is neither a number nor the name of a column"},
           {"ox,oy,oz,dx,dy,dy\n", "there are two columns 'dy'"},
           {"ox,oy,oz,dx,dy\n", "there is no column 'dz'"},
           {"1,2,3,4,,6\n", "column 5 (dy): '' is not a number"},
           {"0x 2 3 4 5 6\n", "'0x' is neither"},
           {ray + "--1 2 3 4 5 6\n", "'--1' is not a number"},
           {std::string(6 << 20, ' '), "line 1: is longer than 65536 bytes"},
           {ray + std::string(100, 'x') + " 2 3 4 5 6\n", "'" + std::string(40, 'x') + "...' is not"},
           {"\x1f\x8b\x08", "is compressed"},
           {std::string("PK\x03\x04", 4), "an archive"},
           {std::string("1 2\0 3 4 5 6", 12), "is neither text"},
           {std::string("\x7fqrstuv\0\1", 9), R"('\x7fqrstuv\x00\x01' is neither a number)"}}) {
    const Outcome outcome = rays(text);
    expect_refused(outcome, Status::malformed_rays, why);
    EXPECT_NE(outcome.err.find((folder_->path() / "rays").string() + ": "), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
  const Outcome first = rays(ray + "1 2 3 4 5 y\n" + std::string(100'000, '\n') + "1 2 3 4 5 z\n");
  expect_refused(first, Status::malformed_rays, "line 2: column 6 (dz): 'y'");
  expect_refused(rays(ray + std::string(1 << 17, '1') + "\n" + ray), Status::malformed_rays,
                 "line 2: is longer than 65536 bytes");
  std::string comments;
  while (comments.size() < 5 << 20) comments += std::string(60'000, '#') + "\n";
  expect_refused(rays(comments + std::string(5 << 20, ' ')), Status::malformed_rays,
                 ": is longer than 65536 bytes");
  expect_refused(query({"--ray", "1 2 3"}), Status::usage, "--ray: a ray has 6 or 8 numbers");
  expect_refused(query({"--ray", kDown, "--ray", "a b c"}), Status::usage, "--ray 2: 'a' is neither");
}

TEST_F(Query, WritesArrays) {
  const std::string out = (folder_->path() / "answers.npy").string();
  // From text, where the count is not known in advance.
  const std::string text = std::string(kDown) + "\n" + kAside + "\n" + kDown + "\n";
  const Outcome outcome = rays(text, {"-o", out, "--hits"});
  EXPECT_EQ(outcome.out, out + ": 3 rays, 33.33% visible, 100.00% certain\n") << outcome.err;
  const std::string bytes = read_bytes(out), same = rays(text, {"--format", "npy", "--hits"}).out;
  EXPECT_EQ(bytes, same);
  const size_t header = 10 + size_t(uint8_t(bytes[8])) + 256 * size_t(uint8_t(bytes[9]));
  EXPECT_EQ(header % 64, 0u);
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\0", 8));
  EXPECT_EQ(bytes[header - 1], '\n');
  for (const char* part :
       {"('visible', '|b1'), ('certain', '|b1'), ('probability', '<f4'), ('t', '<f4')", "'shape': (3,)"})
    EXPECT_NE(bytes.find(part), std::string::npos) << part;
  ASSERT_EQ(bytes.size(), header + 3 * 34);
  float t[2], nz;
  uint32_t instance[2];
  for (const size_t i : {0, 1}) {
    std::memcpy(&t[i], &bytes[header + 34 * i + 6], 4);
    std::memcpy(&instance[i], &bytes[header + 34 * i + 22], 4);
  }
  std::memcpy(&nz, &bytes[header + 18], 4);
  EXPECT_EQ(t[0], 2);
  EXPECT_EQ(nz, 1);
  EXPECT_EQ(instance[0], 0u);
  EXPECT_EQ(t[1], std::numeric_limits<float>::infinity());
  EXPECT_EQ(instance[1], ~0u);
  EXPECT_EQ(bytes[header], 0);
  EXPECT_EQ(bytes[header + 34], 1);
  // With a known count, and with none.
  EXPECT_EQ(piped(npy_of("<f4", "(1, 6)", std::string(24, '\0')), "--format npy").out.size(), 128u + 6);
  EXPECT_NE(piped("", "--format npy").out.find("'shape': (0,)"), std::string::npos);
}

TEST_F(Query, WritesWholeFilesOrNone) {
  const std::vector<std::string> before = listing(folder_->path());
  const std::string out = (folder_->path() / "a.jsonl").string();
  EXPECT_EQ(rays("1 2 3 4 5 6\nx\n", {"-o", out}).code, int(Status::malformed_rays));
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_EQ(query({"--ray", kDown, "-o", out, "--quiet"}).out, "");
  EXPECT_EQ(read_bytes(out), "{\"visible\":false,\"certain\":true,\"probability\":0}\n");
  EXPECT_EQ(query({"--ray", kDown, "-o", out, "--format", "csv"}).code, 0);
  EXPECT_EQ(read_bytes(out), "visible,certain,probability\n0,1,0\n");
  EXPECT_EQ(query({"--ray", kDown, "-o", "-"}).out, read_bytes(out));
  std::filesystem::remove(out);
  const std::string file = folder_->write("rays", "1 2 3 4 5 6\n").string();
  expect_refused(query({"--rays", file, "-o", file}), Status::usage, "overwrite");
  expect_refused(query({"--ray", kDown, "-o", *asset_}), Status::usage, "overwrite");
  expect_refused(Process(nif_path(), {"query", *asset_, "--ray", kDown}, "/dev/full").finish(),
                 Status::output_not_writable, "standard output: cannot be written");
  std::filesystem::remove(file);
  EXPECT_TRUE(std::ranges::includes(before, listing(folder_->path())));
}

TEST_F(Query, RefusesOptionsAndFilesByName) {
  expect_refused(query({}), Status::usage, "no rays are given");
  expect_refused(query({"--ray", kDown, "--rays", "x"}), Status::usage, "--ray");
  expect_refused(query({"--ray", kDown, "--isa", "mmx"}), Status::usage, "mmx");
  expect_refused(query({"--rays", "none.csv"}), Status::file_not_found, "none.csv: ");
  expect_refused(query({"--rays", folder_->path().string()}), Status::file_unreadable,
                 folder_->path().string());
  expect_refused(nif({"query", "none.nif", "--ray", kDown}), Status::file_not_found, "none.nif");
  expect_refused(nif({"query", folder_->write("rays", "x").string(), "--ray", kDown}), Status::not_a_nif,
                 "rays");
}

/// Several chunks and batches, answered by several threads in order; chunks end anywhere in a line.
TEST_F(Query, KeepsTheOrderOfManyRays) {
  std::string text, wanted;
  for (int i = 0; i < 150'000; ++i) {
    const bool down = i * 7919 % 10 < 3;
    text += down ? "0.25000,0.5,2,0,0,-1\r\n" : "3.000000,3.0,2,0,0,-1\r\n";
    wanted += down ? '0' : '1';
  }
  EXPECT_EQ(visible(rays(text, {"-j", "2"})), wanted);
  EXPECT_EQ(visible(piped(text, "-j 1")), wanted);
}

/// Each line is answered before the next one arrives.
TEST_F(Query, AnswersAPipeAtOnce) {
  const Outcome outcome = Process("/bin/bash", {"-c",
                                                R"(coproc N { exec "$0" query "$1" --rays -; }
                  for x in 0.25 3 0.75; do
                    echo "$x 0.5 2 0 0 -1" >&"${N[1]}"
                    [[ $x != 0.25 ]] || read -r -t 60 header <&"${N[0]}"
                    read -r -t 60 answer <&"${N[0]}" && echo "$answer"
                  done)",
                                                nif_path().string(), *asset_})
                              .finish();
  EXPECT_EQ(outcome.out, "0,1,0\n1,1,1\n0,1,0\n") << outcome.err;
}

TEST_F(Query, APipeThatNobodyReadsEndsItQuietly) {
  std::string text;
  for (int i = 0; i < 50'000; ++i) text += "3 3 2 0 0 -1\n";
  const std::string file = folder_->write("rays", text).string();
  const Outcome outcome =
      Process("/bin/bash", {"-c", R"("$0" query "$1" --rays "$2" | head -n 1; exit "${PIPESTATUS[0]}")",
                            nif_path().string(), *asset_, file})
          .finish();
  EXPECT_EQ(outcome.code, 128 + 13);
  EXPECT_EQ(outcome.err, "");
}

}  // namespace
}  // namespace nif::test
