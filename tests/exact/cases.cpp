// Draws cases, asks and judges them, cuts down what is wrong by halves, and reads and writes cases as text.
#include "tests/exact/cases.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "formats/base/status.hpp"
#include "tests/exact/judge.hpp"
#include "tests/exact/skewed.hpp"
#include "tests/support/to_world.hpp"

namespace nif::test {
namespace {

bool is_finite(const float v[3]) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }
bool has_points(const NifRay& ray) {
  return is_finite(ray.origin) && is_finite(ray.direction) && ray.tmin <= ray.tmax &&
         (ray.direction[0] != 0 || ray.direction[1] != 0 || ray.direction[2] != 0);
}

/// A ray relative to one instance of a scene.
struct Part {
  const Look* look;
  bool triangles;
  bool met;  ///< if false, the instance has no effect
};

/// Examines rays; scenes share the results.
class Looks {
 public:
  Looks(const Judge& judge, size_t rays) : judge_(judge) {
    for (auto& known : known_) known.resize(rays);
  }

  /// For a scene: `ray` is the i-th ray, untransformed or transformed.
  std::vector<Part> parts(const std::vector<Instance>& instances, bool moved, const NifRay& ray, size_t i) {
    std::vector<Part> parts;
    for (const Instance& one : instances) {
      // What planes prove holds for the ray itself. Answers by triangles may be those of a ray moved by less
      // than 2^-14 of the extent, unless the instance is untransformed.
      const bool in_place = one.in_place(), loose = one.has_triangles() && !in_place;
      const double aside = loose ? 0x1.02p-14 * double(judge_.extent()) : 0;
      auto& known = known_[moved][i];
      auto it = std::find_if(known.begin(), known.end(), [&](const Known& k) {
        return k.loose == loose && k.transform == one.placed && k.remainder == one.remainder;
      });
      if (it == known.end()) {
        it = known.insert(
            known.end(),
            {loose, one.placed, one.remainder,
             std::make_unique<Look>(in_place ? judge_.look(ray)
                                             : judge_.look(ray, one.placed, aside, one.remainder))});
      }
      parts.push_back({it->look.get(), one.has_triangles(), one.met});
    }
    return parts;
  }

 private:
  struct Known {
    bool loose;
    Transform transform;
    std::array<float, 3> remainder;
    std::unique_ptr<Look> look;
  };
  const Judge& judge_;
  std::vector<std::vector<Known>> known_[2];
};

/// What is wrong with the answers to ray i, which is not empty.
std::string wrong(const Judge& judge, const std::vector<Part>& parts, const Subject& subject,
                  const Said& said, size_t i) {
  const FirstHits& hits = said.hits;
  std::string what;
  /// Whether the check holds for all instances, or for any.
  const auto all = [&](const auto& ask) {
    for (const Part& part : parts)
      if (part.met)
        if (what = ask(*part.look); !what.empty()) return false;
    return true;
  };
  const auto any = [&](const auto& ask) {
    what = "something, but there is nothing that rays can meet";
    return std::any_of(parts.begin(), parts.end(),
                       [&](const Part& part) { return part.met && (what = ask(*part.look)).empty(); });
  };
  if (said.certain[i]) {
    const bool right = said.visible[i] ? all([&](const Look& look) { return judge.visible(look); })
                                       : any([&](const Look& look) { return judge.occluded(look); });
    if (!right) return what;
  }
  const auto has_triangles = [](const Part& part) { return part.met && part.triangles; };
  const bool only_triangles =
      std::all_of(parts.begin(), parts.end(), [](const Part& part) { return !part.met || part.triangles; });
  const auto met = std::count_if(parts.begin(), parts.end(), [](const Part& part) { return part.met; });
  if (only_triangles && (hits.hit[i] != 0) == (said.visible[i] != 0)) return "visible and hit, or neither";
  if (hits.hit[i] && (hits.instance[i] >= parts.size() || !parts[hits.instance[i]].met))
    return "a hit of an instance that there is not";
  if (hits.certain[i] && hits.hit[i]) {
    const bool at_t = hits.low[i] == hits.t[i] && hits.t[i] == hits.high[i];
    if (only_triangles && met == 1 && !at_t) return "bounds of a triangle's hit that are not its t";
    const Part& of = parts[hits.instance[i]];
    if (of.triangles && at_t) {
      mesh::Float3 corners[3];
      subject.corners_of(hits.triangle[i], corners);
      what = judge.first_hit(*of.look, hits.t[i], corners);
      const float before = std::nextafter(hits.t[i], -kEndless);
      if (!what.empty() || !all([&](const Look& look) { return judge.nothing_before(look, before); }))
        return what;
    }
  }
  // By triangles both equal t, rounded to a float.
  const bool rounded = std::any_of(parts.begin(), parts.end(), has_triangles);
  const float low = rounded ? std::nextafter(hits.low[i], -kEndless) : hits.low[i];
  const float high = rounded ? std::nextafter(hits.high[i], kEndless) : hits.high[i];
  if (!all([&](const Look& look) { return judge.nothing_before(look, low); })) return what;
  if (hits.high[i] < kEndless && !any([&](const Look& look) { return judge.something_until(look, high); }))
    return what;
  if (said.listed[i] &&
      !all([&](const Look& look) { return judge.only_between(look, said.begin[i], said.end[i]); }))
    return what;
  if (said.listed[i] && said.open[i] != NIF_NONE) {
    if (said.open[i] >= parts.size() || !parts[said.open[i]].met)
      return "left open by an instance that there is not";
    for (uint32_t k = 0; k < parts.size(); ++k)
      if (k != said.open[i] && parts[k].met)
        if (what = judge.visible(*parts[k].look); !what.empty()) return "left open by another alone; " + what;
  }
  return {};
}

/// For an empty ray, or one with NaN.
std::string wrong_of_none(const NifRay& ray, const Said& said, size_t i) {
  const bool no_points = ray.tmin > ray.tmax;
  const bool right = said.visible[i] && (said.certain[i] != 0) == no_points;
  return right ? std::string() : "an invalid ray that is answered";
}

Random of_grid(uint64_t seed) { return Random(seed, 1, 1); }

/// Rays of random kinds, so that batches have some of each.
std::vector<NifRay> draw_rays(const mesh::Mesh& mesh, const mesh::Box& box, uint32_t count, Random& random) {
  const auto generators = ray_generators();
  const float extent = *std::max_element(box.max.begin(), box.max.end());
  std::vector<NifRay> rays;
  for (uint32_t i = 0; i < count; ++i) {
    // Few of the last kind, invalid rays. The kind before it is for large meshes, and frequent there.
    size_t kind = random.below(uint32_t(generators.size() - 2));
    if (extent > 0x1p43f && random.below(3) == 0) kind = generators.size() - 2;
    if (random.below(64) == 0) kind = generators.size() - 1;
    rays.push_back(generators[kind].draw(mesh, box, random));
  }
  return rays;
}

}  // namespace

Tally& Tally::operator+=(const Tally& other) {
  rays += other.rays, certain += other.certain, answers += other.answers, refused += other.refused;
  return *this;
}

Case draw_case(uint64_t seed, uint64_t number, uint32_t rays) {
  Random random(seed, 0xca5e, number);
  const auto meshes = mesh_generators();
  const auto transforms = transform_generators();
  if (number % (meshes.size() + 1) == meshes.size()) {
    const uint64_t grid = random.bits();
    Random drawn = of_grid(grid);
    const GridShape shape = draw_grid(drawn);
    SkewedSheet sheet = draw_skewed_sheet(1.0 / (shape.resolution << shape.levels), rays, random);
    return {"skewed sheet", std::move(sheet.hostile), sheet.transform, std::move(sheet.rays), grid};
  }
  const MeshGenerator& mesh = meshes[number % (meshes.size() + 1)];
  Case one{mesh.name, mesh.make(random), {}, {}, random.bits()};
  const mesh::Box box = mesh::bounds(one.hostile.mesh.positions, one.hostile.mesh.triangles);
  const TransformGenerator& transform = transforms[random.below(uint32_t(transforms.size()))];
  one.name += std::string(", ") + transform.name;
  one.transform = transform.draw(box, random);
  one.rays = draw_rays(one.hostile.mesh, box, rays, random);
  return one;
}

std::vector<Finding> judge(const Case& one, const std::vector<Way>& ways, uint32_t gpu_rays, Tally& tally) {
  std::vector<Finding> findings;
  std::optional<Subject> subject;
  Random random = of_grid(one.grid);
  try {
    subject.emplace(one.hostile.mesh, one.transform, random);
  } catch (const nif::Error& error) {
    // Too large or too small for an encoding. Findings of the baker's own checks do not count.
    if (error.status() == Status::internal)
      findings.push_back({Placed::bvh, "bake", one.rays.at(0), error.what()});
    else
      ++tally.refused;
    return findings;
  }
  const Judge judge(one.hostile.mesh, one.hostile.closed);
  // In world space, and in a world behind the transform.
  std::vector<NifRay> moved;
  for (const NifRay& ray : one.rays) moved.push_back(to_world(ray, one.transform));
  Looks looks(judge, one.rays.size());
  std::vector<std::optional<Said>> base(kPlaced);
  for (const Way& way : ways) {
    const nifkit::Asset asset = subject->load(way);
    for (uint32_t p = 0; p < kPlaced; ++p) {
      const auto placed = Placed(p);
      const std::vector<Instance>& instances = subject->instances(placed);
      if (instances.empty()) continue;
      const std::vector<NifRay>& rays = is_moved(placed) ? moved : one.rays;
      // With few rays at a time, some suffice: the calls take the time.
      const bool first_way = &way == ways.data();
      const size_t asked = placed >= Placed::crowd ? std::min<size_t>(rays.size(), 250) : rays.size();
      const size_t most = first_way        ? asked
                          : way.gpu        ? gpu_rays
                          : way.most <= 2  ? 32
                          : way.most < 100 ? 200
                                           : asked;
      const size_t count = std::min(most, asked);
      if (count == 0) continue;
      const size_t first = random.below(uint32_t(asked - count + 1));
      std::optional<Said> said;
      try {
        said = subject->ask(
            way, asset, placed,
            {rays.begin() + std::ptrdiff_t(first), rays.begin() + std::ptrdiff_t(first + count)});
      } catch (const nifkit::Error& error) {
        if (error.code() != NIF_ERROR_SINGULAR_TRANSFORM) throw;
        continue;
      } catch (const std::runtime_error& error) {
        findings.push_back({placed, way.name, rays[first], error.what()});
        continue;
      }
      tally.answers += kCalls * count;
      if (first_way) {
        tally.rays += count;
        for (size_t i = 0; i < count; ++i) {
          tally.certain += said->certain[i];
          std::string what;
          if (has_points(rays[i])) {
            what = wrong(judge, looks.parts(instances, is_moved(placed), rays[i], i), *subject, *said, i);
          } else {
            what = wrong_of_none(rays[i], *said, i);
          }
          if (!what.empty()) findings.push_back({placed, way.name, rays[i], std::move(what)});
        }
        base[p] = std::move(said);
        continue;
      }
      if (!base[p]) continue;
      for (size_t j = 0; j < count; ++j)
        if (!agree(*base[p], first + j, *said, j))
          findings.push_back({placed, way.name, rays[first + j], both(*base[p], first + j, *said, j)});
    }
  }
  return findings;
}

Case minimise(const Case& one, const Finding& finding, const std::vector<Way>& ways) {
  Case least = one;
  const auto still_wrong = [&](const Case& some) {
    Tally tally;
    const std::vector<Finding> found = judge(some, ways, 1000, tally);
    return std::any_of(found.begin(), found.end(), [&](const Finding& f) {
      return f.placed == finding.placed && (f.way == ways[0].name) == (finding.way == ways[0].name);
    });
  };
  // Reduces the rays by halves, because batches may matter.
  for (size_t part = least.rays.size(); part > 0; part /= 2)
    for (size_t first = 0; least.rays.size() > 1 && first < least.rays.size();) {
      Case fewer = least;
      const size_t last = std::min(first + part, fewer.rays.size());
      fewer.rays.erase(fewer.rays.begin() + std::ptrdiff_t(first), fewer.rays.begin() + std::ptrdiff_t(last));
      if (!fewer.rays.empty() && still_wrong(fewer))
        least = std::move(fewer);
      else
        first += part;
    }
  auto& triangles = least.hostile.mesh.triangles;
  for (size_t part = triangles.size() / 2; part > 0; part /= 2)
    for (size_t first = 0; first < triangles.size();) {
      Case fewer = least;
      auto& rest = fewer.hostile.mesh.triangles;
      fewer.hostile.closed = false;
      rest.erase(rest.begin() + std::ptrdiff_t(first),
                 rest.begin() + std::ptrdiff_t(std::min(first + part, rest.size())));
      if (!rest.empty() && still_wrong(fewer))
        least = std::move(fewer);
      else
        first += part;
    }
  return least;
}

std::string to_text(const Case& one, const std::vector<std::string>& remarks) {
  std::ostringstream text;
  for (const std::string& remark : remarks) text << "# " << remark << '\n';
  text << std::hexfloat << "name " << one.name << "\nclosed " << one.hostile.closed << "\ngrid " << one.grid
       << "\ntransform";
  for (const float x : one.transform) text << ' ' << x;
  text << '\n';
  std::vector<uint32_t> number(one.hostile.mesh.positions.size(), 0);
  uint32_t used = 0;
  for (const mesh::Triangle& t : one.hostile.mesh.triangles) {
    for (const uint32_t corner : t) {
      if (number[corner]) continue;
      number[corner] = ++used;
      const mesh::Float3& p = one.hostile.mesh.positions[corner];
      text << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
    }
    text << "f " << number[t[0]] << ' ' << number[t[1]] << ' ' << number[t[2]] << '\n';
  }
  for (const NifRay& r : one.rays)
    text << "ray " << r.origin[0] << ' ' << r.origin[1] << ' ' << r.origin[2] << ' ' << r.direction[0] << ' '
         << r.direction[1] << ' ' << r.direction[2] << ' ' << r.tmin << ' ' << r.tmax << '\n';
  return text.str();
}

Case read_case(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be read");
  Case one;
  one.hostile.mesh.name = file.stem().string();
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    std::istringstream words(line);
    std::string key, word;
    words >> key;
    const auto refuse = [&] {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": '" + line +
                               "' is no line of a case");
    };
    const auto read = [&](float& x) {  // streams cannot read hexadecimal floats
      if (!(words >> word)) refuse();
      size_t length = 0;
      x = std::stof(word, &length);
      if (length != word.size()) refuse();
    };
    if (key.empty() || key[0] == '#') continue;
    if (key == "name") {
      std::getline(words >> std::ws, one.name);
    } else if (key == "closed") {
      words >> one.hostile.closed;
    } else if (key == "grid") {
      words >> one.grid;
    } else if (key == "transform") {
      for (float& x : one.transform) read(x);
    } else if (key == "v") {
      for (float& x : one.hostile.mesh.positions.emplace_back()) read(x);
    } else if (key == "f") {
      for (uint32_t& corner : one.hostile.mesh.triangles.emplace_back())
        if (!(words >> corner) || corner-- == 0 || corner >= one.hostile.mesh.positions.size()) refuse();
    } else if (key == "ray") {
      NifRay& r = one.rays.emplace_back();
      for (float* x : {&r.origin[0], &r.origin[1], &r.origin[2], &r.direction[0], &r.direction[1],
                       &r.direction[2], &r.tmin, &r.tmax})
        read(*x);
    } else {
      refuse();
    }
  }
  return one;
}

}  // namespace nif::test
