// A study, not a test: how well visibility can be guessed from an opacity per voxel, alone or by direction, and from the
// best constant for the voxel and direction with which a ray begins. docs/results/foliage.sh compares that with what
// a network makes of its features.
//
//   voxel_opacity MESH VOXELS RAYS
//
// VOXELS of a plain grid lie along the longest side of the mesh. Opacities are fitted to RAYS rays of each of three ray
// sets together (expectation and maximisation over where a blocked ray ends), and judged on as many others.
// Prints a tab-separated line for each model and set: the model, numbers that it has stored, set, Brier score, share
// of answers that are wrong, and expected calibration error over all rays.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <unordered_map>

#include "bake/ground_truth/evaluate.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"

namespace {

using namespace nif;
using kernels::Segment;

constexpr std::array kSets{bake::RaySet::outer_lines, bake::RaySet::inner_surface, bake::RaySet::segments};
constexpr uint64_t kTrainingSeed = 1000, kTestSeed = 5;
constexpr int kRounds = 6;
/// Each opacity starts as if so many voxel lengths had been passed with the mean opacity of all.
constexpr double kPrior = 2;
constexpr uint32_t kDirections = 12;

/// A line's direction, whichever way it runs: the longest axis, and the signs of the others against it.
uint32_t direction_of(const Segment& ray) {
  uint32_t axis = 0;
  for (uint32_t a = 1; a < 3; ++a)
    if (std::abs(ray.direction[a]) > std::abs(ray.direction[axis])) axis = a;
  uint32_t signs = 0;
  for (uint32_t a = 1; a < 3; ++a)
    signs = 2 * signs + ((ray.direction[(axis + a) % 3] < 0) != (ray.direction[axis] < 0));
  return 4 * axis + signs;
}

struct Passage {
  uint32_t voxel;
  float length;  ///< in voxels
};

/// Voxels that a segment passes, by stepping to the next plane, which is enough for a study.
class Grid {
 public:
  Grid(const mesh::Box& box, uint32_t voxels) {
    double longest = 0;
    for (size_t a = 0; a < 3; ++a) longest = std::max(longest, double(box.max[a]) - double(box.min[a]));
    scale_ = voxels / longest;
    for (size_t a = 0; a < 3; ++a) {
      low_[a] = double(box.min[a]);
      count_[a] = std::max(1, int(std::ceil((double(box.max[a]) - low_[a]) * scale_)));
    }
  }

  void pass(const Segment& ray, std::vector<Passage>& passages) const {
    passages.clear();
    std::array<double, 3> o, d;
    double from = double(ray.tmin), to = double(ray.tmax), square = 0;
    for (size_t a = 0; a < 3; ++a) {
      o[a] = (double(ray.origin[a]) - low_[a]) * scale_;
      d[a] = double(ray.direction[a]) * scale_;
      square += d[a] * d[a];
      if (d[a] == 0) {
        if (o[a] < 0 || o[a] > count_[a]) return;
        continue;
      }
      const double first = -o[a] / d[a], last = (count_[a] - o[a]) / d[a];
      from = std::max(from, std::min(first, last));
      to = std::min(to, std::max(first, last));
    }
    const double per_t = std::sqrt(square);
    for (double t = from; t < to;) {
      std::array<int, 3> at;
      double next = to;
      const double inside = t + 1e-9 * (std::abs(t) + 1 / per_t);
      for (size_t a = 0; a < 3; ++a) {
        at[a] = std::clamp(int(std::floor(o[a] + inside * d[a])), 0, count_[a] - 1);
        if (d[a] != 0) next = std::min(next, (at[a] + (d[a] > 0) - o[a]) / d[a]);
      }
      next = std::max(next, inside);
      passages.push_back({uint32_t(at[0] + count_[0] * (at[1] + count_[1] * at[2])),
                          static_cast<float>((std::min(next, to) - t) * per_t)});
      t = next;
    }
  }

  size_t voxels() const { return size_t(count_[0]) * size_t(count_[1]) * size_t(count_[2]); }

 private:
  double scale_;
  std::array<double, 3> low_;
  std::array<int, 3> count_;
};

void print(std::string_view model, size_t numbers, bake::RaySet set, const bake::Accuracy& accuracy) {
  fmt::print("{}\t{}\t{}\t{}\t{}\t{}\n", model, numbers, bake::name_of(set), accuracy.brier(),
             accuracy.error(), accuracy.calibration_error());
}

struct Drawn {
  std::array<bake::RaysWithTruth, kSets.size()> training, test;
};

template <class Guess>
void judge(std::string_view model, size_t numbers, const Drawn& drawn, const bake::RaySource& source,
           const Guess& guess) {
  for (size_t s = 0; s < kSets.size(); ++s) {
    const auto answer = [&](std::span<const Segment> rays, const bake::Answers& answers) {
      for (size_t i = 0; i < rays.size(); ++i) {
        answers.probability[i] = static_cast<float>(guess(rays[i]));
        answers.visible[i] = answers.probability[i] >= 0.5f;
        answers.certain[i] = 0;
      }
    };
    print(model, numbers, kSets[s], bake::evaluate(drawn.test[s], answer, source.embree));
  }
}

/// exp(-sum of opacity times length), with one opacity for each voxel and way to pass it.
void judge_opacity(const Grid& grid, uint32_t directions, const Drawn& drawn, const bake::RaySource& source) {
  struct Count {
    double blocks = 0, passed = 0;
  };
  const auto number = [&](const Passage& passage, uint32_t direction) {
    return size_t(passage.voxel) * directions + direction;
  };
  const auto way = [&](const Segment& ray) { return directions == 1 ? 0 : direction_of(ray); };
  std::vector<double> opacity(grid.voxels() * directions, 0.1);
  std::vector<Passage> passages;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Count> counts(opacity.size());
    Count all;
    for (const bake::RaysWithTruth& rays : drawn.training)
      for (size_t i = 0; i < rays.segments.size(); ++i) {
        const Segment& ray = rays.segments[i];
        grid.pass(ray, passages);
        const uint32_t direction = way(ray);
        double sum = 0;
        for (const Passage& p : passages) sum += opacity[number(p, direction)] * double(p.length);
        const bool blocked = !rays.visible[i];
        const double blocks_at_all = std::max(1 - std::exp(-sum), 1e-9);
        double left = 1;  // probability of getting as far, if blocked: and not beyond
        for (const Passage& p : passages) {
          Count& count = counts[number(p, direction)];
          if (!blocked) {
            count.passed += double(p.length);
            continue;
          }
          const double through = std::exp(-opacity[number(p, direction)] * double(p.length));
          const double here = left * (1 - through) / blocks_at_all;
          left *= through;
          const double beyond = std::max(left - std::exp(-sum), 0.0) / blocks_at_all;
          count.blocks += here;
          count.passed += double(p.length) * (beyond + here / 2);
        }
      }
    for (const Count& count : counts) all.blocks += count.blocks, all.passed += count.passed;
    const double mean = all.blocks / all.passed;
    for (size_t v = 0; v < opacity.size(); ++v)
      opacity[v] = (counts[v].blocks + kPrior * mean) / (counts[v].passed + kPrior);
    // What no training ray was stopped by is empty, and needs no number.
    if (round + 1 < kRounds) continue;
    size_t numbers = 0;
    for (const Count& count : counts) numbers += count.blocks > 0.01;
    judge(directions == 1 ? "opacity per voxel" : "opacity per voxel and direction", numbers, drawn, source,
          [&](const Segment& ray) {
            std::vector<Passage> passed;
            grid.pass(ray, passed);
            double sum = 0;
            for (const Passage& p : passed) sum += opacity[number(p, way(ray))] * double(p.length);
            return std::exp(-sum);
          });
  }
}

/// The share of visible rays of each set that begin in a voxel in a direction, either way.
void judge_constant(const Grid& grid, const Drawn& drawn, const bake::RaySource& source) {
  struct Count {
    double rays = 2, visible = 1;
  };
  for (size_t s = 0; s < kSets.size(); ++s) {
    std::unordered_map<uint64_t, Count> counts;
    const auto key = [&](const Segment& ray, std::vector<Passage>& passages) {
      grid.pass(ray, passages);
      const uint64_t up = ray.direction[2] > 0;
      return passages.empty() ? ~uint64_t{0}
                              : (uint64_t{passages[0].voxel} * kDirections + direction_of(ray)) * 2 + up;
    };
    std::vector<Passage> passages;
    const bake::RaysWithTruth& rays = drawn.training[s];
    for (size_t i = 0; i < rays.segments.size(); ++i) {
      Count& count = counts[key(rays.segments[i], passages)];
      ++count.rays;
      count.visible += rays.visible[i];
    }
    const auto answer = [&](std::span<const Segment> some, const bake::Answers& answers) {
      std::vector<Passage> passed;
      for (size_t i = 0; i < some.size(); ++i) {
        const auto found = counts.find(key(some[i], passed));
        const Count count = found == counts.end() ? Count() : found->second;
        answers.probability[i] = static_cast<float>(count.visible / count.rays);
        answers.visible[i] = answers.probability[i] >= 0.5f;
        answers.certain[i] = 0;
      }
    };
    print("constant per first voxel and direction", counts.size(), kSets[s],
          bake::evaluate(drawn.test[s], answer, source.embree));
  }
}

void run(const std::string& mesh, uint32_t voxels, uint64_t count) {
  if (voxels == 0 || voxels > 1024) throw Error(Status::usage, "VOXELS must be 1 to 1024");
  const mesh::Scene scene = mesh::read(mesh);
  const bake::PreparedScene prepared = bake::prepare(scene);
  if (prepared.objects.size() != 1) throw Error(Status::usage, mesh + ": needs exactly one object");
  const bake::GroundTruth truth(prepared.objects.front());
  const bake::RaySource& source = truth.source();
  Drawn drawn;
  for (size_t s = 0; s < kSets.size(); ++s) {
    drawn.training[s] = bake::make_ray_set(source, kSets[s], count, kTrainingSeed);
    drawn.test[s] = bake::make_ray_set(source, kSets[s], count, kTestSeed);
  }
  const Grid grid(source.box, voxels);
  judge_constant(grid, drawn, source);
  judge_opacity(grid, 1, drawn, source);
  judge_opacity(grid, kDirections, drawn, source);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr, "usage: voxel_opacity MESH VOXELS RAYS\n");
    return int(Status::usage);
  }
  try {
    run(argv[1], uint32_t(std::strtoul(argv[2], nullptr, 10)), std::strtoull(argv[3], nullptr, 10));
    return 0;
  } catch (const Error& error) {
    fmt::print(stderr, "voxel_opacity: {}\n", error.what());
    return int(error.status());
  }
}
