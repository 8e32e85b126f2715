// Stems and leaves are painted over each other on a canvas of 4 x 4 samples for each texel.
#include "mesh/generate/twig_picture.hpp"

#include <algorithm>
#include <cmath>

#include "formats/base/random.hpp"
#include "mesh/generate/png.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {
namespace {

constexpr uint64_t kTwigStream = 0x74776967;  // "twig"
constexpr uint32_t kSamples = 4;              // of a texel, along a side
constexpr uint32_t kTwigSide = kPictureSide / kTwigs * kSamples;

using Colour = std::array<uint8_t, 3>;

Colour mix(const Colour& a, const Colour& b, double part) {
  Colour mixed;
  for (size_t c = 0; c < 3; ++c) mixed[c] = uint8_t(a[c] + (b[c] - a[c]) * part + 0.5);
  return mixed;
}

/// x to the right and y up, in lengths of the twig.
struct TwigPoint {
  double x, y;
};

/// A square of samples with one twig.
class Canvas {
 public:
  Canvas() : samples_(size_t{kTwigSide} * kTwigSide) {}

  struct Sample {
    Colour colour{};
    bool covered = false;
  };
  const Sample& at(uint32_t x, uint32_t y) const { return samples_[size_t{y} * kTwigSide + x]; }

  /// Paints what lies along the way from `from` in direction `way`, a part of `reach` to all sides. `colour(along, aside)`
  /// gives a colour or nothing; lengths are parts of `length`.
  template <class ColourAt>
  void paint(const TwigPoint& from, const Turn& way, double length, double reach, const ColourAt& colour) {
    const TwigPoint to{from.x + way.cos * length, from.y + way.sin * length};
    const double margin = reach * length;
    // A texel at the border stays empty, so that neighbours do not show.
    const auto clamped = [](double at) {
      return uint32_t(std::clamp(at, double{kSamples}, double{kTwigSide - kSamples}));
    };
    const uint32_t left = clamped(column(std::min(from.x, to.x) - margin)),
                   right = clamped(column(std::max(from.x, to.x) + margin) + 1),
                   top = clamped(row(std::max(from.y, to.y) + margin)),
                   bottom = clamped(row(std::min(from.y, to.y) - margin) + 1);
    for (uint32_t y = top; y < bottom; ++y)
      for (uint32_t x = left; x < right; ++x) {
        const double dx = (x + 0.5) / kTwigSide - 0.5 - from.x, dy = 1 - (y + 0.5) / kTwigSide - from.y;
        Sample& sample = samples_[size_t{y} * kTwigSide + x];
        if (colour((dx * way.cos + dy * way.sin) / length, (dy * way.cos - dx * way.sin) / length,
                   sample.colour))
          sample.covered = true;
      }
  }

 private:
  static double column(double x) { return (x + 0.5) * kTwigSide; }
  static double row(double y) { return (1 - y) * kTwigSide; }

  std::vector<Sample> samples_;
};

class Painter {
 public:
  Painter(Canvas& canvas, const Foliage& foliage, Random& random)
      : canvas_(canvas), foliage_(foliage), random_(random) {}

  /// A stem with leaves on both sides and one at its end; `turns` from the x axis.
  void twig(const TwigPoint& from, double turns, double length, double bend, uint32_t twigs, uint32_t pairs) {
    constexpr uint32_t kPieces = 16;
    std::array<TwigPoint, kPieces + 1> stem{from};
    for (uint32_t i = 0; i < kPieces; ++i) {
      const Turn way = turn(turns + bend * i / kPieces);
      stem[i + 1] = {stem[i].x + way.cos * length / kPieces, stem[i].y + way.sin * length / kPieces};
      const double width = 0.014 * std::sqrt(length) * (1.2 - double(i) / kPieces) * kPieces / length;
      canvas_.paint(stem[i], way, length / kPieces, 0.5 + width,
                    [&](double along, double aside, Colour& colour) {
                      if (along < -0.1 || along > 1.1 || std::fabs(aside) > width) return false;
                      colour = {92, 74, 48};
                      return true;
                    });
    }
    const auto place = [&](double part) {
      const double at = part * kPieces;
      const auto piece = std::min(uint32_t(at), kPieces - 1);
      const double rest = at - piece;
      return TwigPoint{stem[piece].x + (stem[piece + 1].x - stem[piece].x) * rest,
                       stem[piece].y + (stem[piece + 1].y - stem[piece].y) * rest};
    };
    for (uint32_t i = 0; i < twigs; ++i) {
      const double part = 0.06 + 0.72 * (i + random_.uniform(0.2, 0.8)) / twigs, side = i % 2 == 0 ? 1 : -1;
      twig(place(part), turns + bend * part + side * random_.uniform(0.11, 0.17),
           foliage_.twig * (1 - 0.6 * part) * random_.uniform(0.85, 1.1), -side * 0.05, 0,
           std::max<uint32_t>(2, uint32_t(pairs * foliage_.twig)));
    }
    for (uint32_t i = 0; i < pairs; ++i)
      for (const double side : {1.0, -1.0}) {
        const double part = 0.06 + 0.9 * (i + random_.uniform()) / pairs;
        leaf(place(part), turns + bend * part + side * foliage_.angle * random_.uniform(0.7, 1.25));
      }
    leaf(stem.back(), turns + bend);
  }

 private:
  void leaf(const TwigPoint& from, double turns) {
    const double length = foliage_.length * random_.uniform(0.75, 1.15), half = foliage_.width / 2,
                 bend = random_.uniform(-0.12, 0.12);
    const Colour upper = mix(foliage_.dark, foliage_.light, random_.uniform()),
                 lower = mix(upper, foliage_.dark, 0.45), rib = mix(upper, foliage_.light, 0.7);
    canvas_.paint(from, turn(turns), length, half + 0.15, [&](double along, double aside, Colour& colour) {
      if (along < 0 || along > 1) return false;
      const double off = aside - bend * along * (1 - along) * 4 * half;
      // Widest before the middle, pointed at the end.
      double border = 5.2 * half * along * (1 - along) * (1.15 - 0.6 * along);
      if (foliage_.lobes > 0) {
        const double wave = turn(along * 3.5).cos;
        border *= 1 - foliage_.lobes * (0.5 + 0.5 * wave);
      }
      if (std::fabs(off) > border) return false;
      colour = std::fabs(off) < 0.022 ? rib : off > 0 ? upper : lower;
      return true;
    });
  }

  Canvas& canvas_;
  const Foliage& foliage_;
  Random& random_;
};

}  // namespace

std::vector<std::byte> draw_twigs(const Foliage& foliage, uint64_t seed) {
  std::vector<std::array<uint8_t, 4>> texels(size_t{kPictureSide} * kPictureSide);
  const Colour around = mix(foliage.dark, foliage.light, 0.4);
  constexpr uint32_t kSide = kPictureSide / kTwigs;
  for (uint32_t number = 0; number < kTwigs * kTwigs; ++number) {
    Random random(seed, kTwigStream, number);
    Canvas canvas;
    Painter(canvas, foliage, random)
        .twig({0, 0}, 0.25 + random.uniform(-0.02, 0.02), 0.96 - 1.1 * foliage.length,
              random.uniform(-0.07, 0.07), foliage.twigs, foliage.pairs);
    for (uint32_t y = 0; y < kSide; ++y)
      for (uint32_t x = 0; x < kSide; ++x) {
        uint32_t covered = 0;
        std::array<uint32_t, 3> sum{};
        for (uint32_t j = 0; j < kSamples; ++j)
          for (uint32_t i = 0; i < kSamples; ++i) {
            const Canvas::Sample& sample = canvas.at(x * kSamples + i, y * kSamples + j);
            if (!sample.covered) continue;
            ++covered;
            for (size_t c = 0; c < 3; ++c) sum[c] += sample.colour[c];
          }
        auto& texel =
            texels[size_t{number / kTwigs * kSide + y} * kPictureSide + number % kTwigs * kSide + x];
        for (size_t c = 0; c < 3; ++c)
          texel[c] = covered == 0 ? around[c] : uint8_t((sum[c] + covered / 2) / covered);
        texel[3] = uint8_t(covered * 255 / (kSamples * kSamples));
      }
  }
  return encode_png(kPictureSide, kPictureSide, texels);
}

}  // namespace nif::generate
