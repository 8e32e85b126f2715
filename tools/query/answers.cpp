// Puts the asset, or one of its objects, into a scene of the runtime. Each batch of rays goes through
// nifQuery, and through nifIntersect if first hits are requested.
#include "tools/query/answers.hpp"

#include <fmt/format.h>

#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"
#include "nif/nif.hpp"

namespace nif::tools {

Asker::Asker(const std::string& asset, const std::string& configuration, const uint32_t* object, bool hits)
    : hits_(hits) {
  const NifError error = nifNewDevice(configuration.c_str(), nullptr, &device_.handle);
  if (error == NIF_ERROR_INVALID_ARGUMENT || error == NIF_ERROR_NOT_AVAILABLE)
    throw Error(Status::usage, nifGetErrorMessage());
  check(error);
  Asset loaded;
  check(nifLoadAssetFile(device_.handle, asset.c_str(), NIF_LOAD_COPY, &loaded.handle));
  NifAssetInfo info{};
  info.struct_size = sizeof(info);
  check(nifGetAssetInfo(loaded.handle, &info));
  if (object && *object >= info.object_count)
    throw Error(Status::usage, fmt::format("--object {}: {} has {}, and the first is 0", *object, asset,
                                           count_of(info.object_count, "object")));
  check(nifNewScene(device_.handle, &scene_.handle));
  check(object ? nifAddInstance(scene_.handle, loaded.handle, *object, nullptr, nullptr)
               : nifAddAsset(scene_.handle, loaded.handle, nullptr, nullptr, nullptr));
  check(nifCommitScene(scene_.handle));
}

void Asker::ask(std::span<const NifRay> rays, Answers& answers) const {
  answers.visible.resize(rays.size());
  answers.certain.resize(rays.size());
  answers.probability.resize(rays.size());
  const NifRays asked = nifMakeRays(rays.data(), rays.size());
  auto to = nifkit::sized<NifAnswers>();
  to.visible = answers.visible.data();
  to.certain = answers.certain.data();
  to.probability = answers.probability.data();
  check(nifQuery(scene_.handle, &asked, &to));
  if (!hits_) return;
  answers.t.resize(rays.size());
  answers.normal.resize(3 * rays.size());
  for (std::vector<uint32_t>* numbers : {&answers.instance, &answers.object, &answers.triangle})
    numbers->resize(rays.size());
  auto found = nifkit::sized<NifHits>();
  found.t = answers.t.data();
  found.normal = answers.normal.data();
  found.instance = answers.instance.data();
  found.object = answers.object.data();
  found.triangle = answers.triangle.data();
  check(nifIntersect(scene_.handle, &asked, &found));
}

}  // namespace nif::tools
