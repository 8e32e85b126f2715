#include "tests/cli/brute_racer.hpp"

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>

namespace nif::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Point = std::array<double, 3>;

template <class T>
std::vector<T> numbers_in(const fs::path& folder, const json& array) {
  size_t count = 1;
  for (const json& side : array["shape"]) count *= side.get<size_t>();
  std::vector<T> numbers(count);
  std::ifstream file(folder / array["file"].get<std::string>(), std::ios::binary);
  file.read(reinterpret_cast<char*>(numbers.data()), std::streamsize(count * sizeof(T)));
  if (!file || file.peek() != std::ifstream::traits_type::eof()) throw std::runtime_error("another size");
  return numbers;
}

template <class T>
void put_numbers(const fs::path& file, const std::vector<T>& numbers) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(numbers.data()), std::streamsize(numbers.size() * sizeof(T)));
}

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point crossed(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double times(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Moeller and Trumbore 1997, both sides.
std::optional<double> meeting(const float* ray, const std::array<Point, 3>& corner) {
  const Point origin{ray[0], ray[1], ray[2]}, direction{ray[4], ray[5], ray[6]};
  const Point a = minus(corner[1], corner[0]), b = minus(corner[2], corner[0]);
  const Point p = crossed(direction, b);
  const double determinant = times(a, p);
  if (determinant == 0) return std::nullopt;
  const Point from = minus(origin, corner[0]), q = crossed(from, a);
  const double u = times(from, p) / determinant, v = times(direction, q) / determinant;
  if (u < 0 || v < 0 || u + v > 1) return std::nullopt;
  const double t = times(b, q) / determinant;
  if (t < double(ray[3]) || t > double(ray[7])) return std::nullopt;
  return t;
}

}  // namespace

BruteRacer::BruteRacer(const fs::path& folder) {
  json race;
  std::ifstream(folder / "race.json") >> race;
  if (race.at("schema") != "nifkit.race/1") throw std::runtime_error("another schema");
  const auto positions = numbers_in<float>(folder, race["positions"]);
  const auto triangles = numbers_in<unsigned>(folder, race["triangles"]);
  const auto transforms = numbers_in<float>(folder, race["transforms"]);
  const auto placed = numbers_in<unsigned>(folder, race["placed"]);

  struct Placed {
    std::array<Point, 3> corner;
    unsigned instance, triangle;
  };
  std::vector<std::vector<Placed>> scenes;
  for (const json& scene : race["scenes"]) {
    std::vector<Placed>& all = scenes.emplace_back();
    const unsigned first = scene["first_instance"];
    for (unsigned i = first; i < first + scene["instances"].get<unsigned>(); ++i) {
      const json& object = race["objects"][placed[i]];
      for (unsigned k = 0; k < object["triangles"].get<unsigned>(); ++k) {
        Placed& one = all.emplace_back(Placed{{}, i, k});
        for (size_t c = 0; c < 3; ++c) {
          const size_t corner = triangles[3 * (object["first_triangle"].get<size_t>() + k) + c];
          const float* at = &positions[3 * (object["first_position"].get<size_t>() + corner)];
          for (size_t row = 0; row < 3; ++row) {
            const float* m = &transforms[12 * size_t(i) + 4 * row];
            one.corner[c][row] = double(m[0]) * double(at[0]) + double(m[1]) * double(at[1]) +
                                 double(m[2]) * double(at[2]) + double(m[3]);
          }
        }
      }
    }
  }

  results = {{"schema", "nifkit.entrant/1"},
             {"program", "brute <&> force"},
             {"version", "1.0"},
             {"processor", race["processor"]},
             {"results", json::array()}};
  for (const auto& [name, set] : race["sets"].items()) {
    const auto rays = numbers_in<float>(folder, set);
    Answers& to = answers.emplace_back(name, Answers{}).second;
    for (size_t s = 0; s < scenes.size(); ++s) {
      const size_t first = set["scenes"][s]["first_ray"], count = set["scenes"][s]["rays"];
      for (size_t r = first; r < first + count; ++r) {
        double nearest = std::numeric_limits<double>::infinity();
        unsigned triangle = 0xffffffff, instance = 0xffffffff;
        for (const Placed& one : scenes[s]) {
          const std::optional<double> t = meeting(&rays[8 * r], one.corner);
          if (!t || *t >= nearest) continue;
          nearest = *t;
          triangle = one.triangle;
          instance = one.instance;
        }
        to.visible.push_back(std::isinf(nearest));
        to.t.push_back(float(nearest));
        to.triangle.push_back(triangle);
        to.instance.push_back(instance);
      }
    }
    for (const char* query : {"visibility", "hits"}) {
      json files{{"visible", name + ".visible"}};
      if (query == std::string("hits"))
        files = {{"t", name + ".t"}, {"triangle", name + ".triangle"}, {"instance", name + ".instance"}};
      results["results"].push_back({{"set", name},
                                    {"hash", set["hash"]},
                                    {"threads", 1},
                                    {"query", query},
                                    {"seconds", {0.25, 0.5, 1.0}},
                                    {"answers", std::move(files)}});
    }
  }
}

std::string BruteRacer::write(const fs::path& folder) const {
  fs::create_directories(folder);
  for (const auto& [name, one] : answers) {
    put_numbers(folder / (name + ".visible"), one.visible);
    put_numbers(folder / (name + ".t"), one.t);
    put_numbers(folder / (name + ".triangle"), one.triangle);
    put_numbers(folder / (name + ".instance"), one.instance);
  }
  std::ofstream(folder / "results.json") << results.dump(2);
  return (folder / "results.json").string();
}

}  // namespace nif::test
