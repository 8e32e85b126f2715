// Asks a scene by every call, in calls of any size, and compares what they say.
#include "tests/exact/ways.hpp"

#include <algorithm>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace nif::test {
namespace {

template <class T>
void put(const std::vector<T>& from, std::vector<T>& to, size_t first, size_t each = 1) {
  std::copy(from.begin(), from.end(), to.begin() + std::ptrdiff_t(first * each));
}

void expect(bool same, const char* what) {
  if (!same) throw std::runtime_error(what);
}

/// One call of each kind.
Said ask_once(const nifkit::Scene& scene, std::span<const NifRay> rays, std::span<const uint32_t> masks) {
  const size_t count = rays.size();
  Said said(count);
  nifkit::Rays query(rays);
  if (masks.size() == 1) query.mask(masks[0]);
  if (masks.size() > 1) query.masks(masks);
  scene.query(query, nifkit::Answers().visible(said.visible).certain(said.certain).logit(said.logit));

  std::vector<uint8_t> visible(count), bits((count + 7) / 8);
  scene.query(query, nifkit::Answers().visible(visible).visible_bits(bits));
  expect(visible == said.visible, "another answer where only visibility is asked for");
  for (size_t i = 0; i < count; ++i)
    expect((bits[i / 8] >> i % 8 & 1) == visible[i], "bits that are not those of the bytes");

  const NifHits hits = said.hits.outputs();
  nifkit::check(nifIntersect(scene.get(), &query.get(), &hits));
  for (size_t i = 0; i < count; ++i)
    expect(said.hits.user[i] == (said.hits.hit[i] ? user_of(said.hits.instance[i]) : 0),
           "not the instance's user value");

  std::vector<uint32_t> listed(count);
  std::vector<float> begin(count), end(count);
  std::vector<uint8_t> proven(count);
  std::vector<uint32_t> instances(count);
  uint32_t open = 0;
  auto lists = nifkit::sized<NifOpenRays>();
  lists.capacity = count;
  lists.rays = listed.data();
  lists.tmin = begin.data();
  lists.tmax = end.data();
  lists.instance = instances.data();
  lists.count = &open;
  scene.query_open(query, nifkit::Answers().visible(visible).certain(proven), lists);
  expect(open <= count, "more open rays than there are rays");
  for (uint32_t k = 0; k < open; ++k) {
    const uint32_t i = listed[k];
    expect(i < count && !said.listed[i], "a ray that is listed twice");
    said.listed[i] = 1;
    said.begin[i] = begin[k];
    said.end[i] = end[k];
    said.open[i] = instances[k];
  }
  for (size_t i = 0; i < count; ++i) {
    expect(!said.listed[i] || (!visible[i] && !proven[i]), "a listed ray that is answered");
    expect(said.listed[i] || visible[i] == said.visible[i], "another answer to a ray that is not listed");
  }

  std::vector<uint8_t> asked(count), decided(count);
  scene.query_with_fallback(query, nifkit::Answers().visible(visible).certain(decided), 2,
                            [&](std::span<const uint64_t> numbers, std::span<uint8_t> answers) {
                              for (size_t k = 0; k < numbers.size(); ++k) {
                                asked[numbers[k]] = 1;
                                answers[k] = 1;
                              }
                            });
  for (size_t i = 0; i < count; ++i) {
    expect(asked[i] != said.certain[i], "a fallback for a certain ray, or none for an open one");
    expect(decided[i] == 1, "an answer of a fallback that is not certain");
    expect(visible[i] == (asked[i] ? 1 : said.visible[i]), "not the answer of the fallback");
  }
  return said;
}

bool same_bits(const float* a, const float* b, size_t count) {
  return std::memcmp(a, b, count * sizeof(float)) == 0;
}

}  // namespace

void add_way(const std::string& config, bool coded, uint64_t most, std::vector<Way>& ways) {
  try {
    ways.push_back({config + (coded ? " coded" : "") + " by " + std::to_string(most), nifkit::Device(config),
                    coded, most});
  } catch (const nifkit::Error& error) {
    if (error.code() != NIF_ERROR_NOT_AVAILABLE) throw;
  }
}

std::vector<Way> make_ways(const std::string& module) {
  std::vector<Way> ways;
  const auto add = [&](const std::string& config, bool coded, uint64_t most) {
    add_way("threads=1," + config, coded, most, ways);
  };
  add("isa=scalar", false, 1000);
  bool coded = false;
  for (const char* isa : {"isa=sse4", "isa=avx2", "isa=avx512", "isa=neon"})
    for (const uint64_t most : {1000, 17, 16, 15, 2, 1}) add(isa, coded = !coded, most);
  add("isa=auto,memory=least", true, 1000);
  add("isa=auto", false, 1000);
  ways.back().name += " mapped";
  ways.back().mapped = true;
  add("isa=scalar", true, 1);
  if (!module.empty()) {
    add("backend=gpu,module=" + module, true, 1000);
    ways.back().gpu = true;
  }
  return ways;
}

Said ask(const nifkit::Scene& scene, const std::vector<NifRay>& rays, std::span<const uint32_t> masks,
         const std::function<uint64_t()>& next_call) {
  Said all(rays.size());
  for (size_t first = 0, count; first < rays.size(); first += count) {
    count = std::min<size_t>(next_call(), rays.size() - first);
    Said said = ask_once(scene, std::span(rays).subspan(first, count),
                         masks.size() > 1 ? masks.subspan(first, count) : masks);
    if (count == rays.size()) return said;
    put(said.visible, all.visible, first), put(said.certain, all.certain, first);
    put(said.listed, all.listed, first), put(said.logit, all.logit, first);
    put(said.begin, all.begin, first), put(said.end, all.end, first);
    put(said.open, all.open, first);
    all.hits.visit_with(said.hits, [&](auto& to, const auto& from) {
      put(from, const_cast<std::remove_cvref_t<decltype(from)>&>(to), first, to.size() / rays.size());
    });
  }
  return all;
}

bool agree(const Said& a, size_t i, const Said& b, size_t j) {
  bool same = a.visible[i] == b.visible[j] && a.certain[i] == b.certain[j] && a.logit[i] == b.logit[j] &&
              a.listed[i] == b.listed[j] && a.open[i] == b.open[j];
  if (a.listed[i])
    same = same && same_bits(&a.begin[i], &b.begin[j], 1) && same_bits(&a.end[i], &b.end[j], 1);
  const FirstHits &p = a.hits, &q = b.hits;
  return same && p.hit[i] == q.hit[j] && p.certain[i] == q.certain[j] && p.triangle[i] == q.triangle[j] &&
         p.instance[i] == q.instance[j] && p.object[i] == q.object[j] && p.user[i] == q.user[j] &&
         same_bits(&p.t[i], &q.t[j], 1) && same_bits(&p.low[i], &q.low[j], 1) &&
         same_bits(&p.high[i], &q.high[j], 1) && same_bits(&p.u[i], &q.u[j], 1) &&
         same_bits(&p.v[i], &q.v[j], 1) && same_bits(&p.normal[3 * i], &q.normal[3 * j], 3) &&
         same_bits(&p.color[3 * i], &q.color[3 * j], 3);
}
std::string both(const Said& a, size_t i, const Said& b, size_t j) {
  std::ostringstream text;
  text << std::hexfloat;
  for (const auto& [said, k] : {std::pair(&a, i), std::pair(&b, j)}) {
    const FirstHits& hits = said->hits;
    text << (said == &a ? "visible " : " but visible ") << int(said->visible[k]) << " certain "
         << int(said->certain[k]) << " logit " << said->logit[k] << " t " << hits.t[k] << " (" << hits.low[k]
         << ".." << hits.high[k] << ") instance " << int32_t(hits.instance[k]) << " triangle "
         << int32_t(hits.triangle[k]) << " normal " << hits.normal[3 * k] << ' ' << hits.normal[3 * k + 1]
         << ' ' << hits.normal[3 * k + 2];
    if (said->listed[k])
      text << " open from " << said->begin[k] << " to " << said->end[k] << " by " << int32_t(said->open[k]);
  }
  return text.str();
}

}  // namespace nif::test
