// Descends folder by folder, with one part of the pattern for each; fnmatch matches single names. Each pair
// of folder and part is visited once, because patterns with several ** reach the same pair very often.
#include "tools/batch/manifest_glob.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <set>

#include "formats/base/folder.hpp"
#include "formats/base/status.hpp"

namespace nif::tools {
namespace {

namespace fs = std::filesystem;

std::vector<fs::directory_entry> entries_of(const fs::path& folder) {
  std::vector<fs::directory_entry> entries;
  const std::error_code problem = for_each_name(folder, [&](const std::string& name) {
    std::error_code ignored;
    entries.emplace_back(folder / name, ignored);
  });
  if (problem)
    throw Error(Status::file_unreadable, folder.string() + ": cannot be listed: " + problem.message());
  return entries;
}

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path.empty() ? "." : path, ignored);
}

using Names = std::vector<std::string>;

class Search {
 public:
  explicit Search(const Names& names) : names_(names) {}
  const std::set<fs::path>& found() const { return found_; }

  /// Matches the names from this one on in a folder.
  void match(const fs::path& at, size_t name) {
    if (!is_folder(at)) return;
    // Several `**` reach a folder in many ways, whose number multiplies with each `**`.
    if (!seen_.emplace(name, at).second) return;
    const bool last = name + 1 == names_.size();
    if (names_[name] == "**") {
      if (!last) match(at, name + 1);
      for (const fs::directory_entry& entry : entries_of(at)) {
        std::error_code ignored;
        const std::string own = entry.path().filename().string();
        if (own.starts_with('.')) continue;
        if (entry.is_directory(ignored) && !entry.is_symlink(ignored))
          match(at / own, name);
        else if (last && entry.is_regular_file(ignored))
          found_.insert(at / own);
      }
      return;
    }
    const auto take = [&](const fs::path& path) {
      std::error_code ignored;
      if (!last)
        match(path, name + 1);
      else if (fs::is_regular_file(path, ignored))
        found_.insert(path);
    };
    if (!is_pattern(names_[name])) return take(at / names_[name]);
    for (const fs::directory_entry& entry : entries_of(at)) {
      const std::string own = entry.path().filename().string();
      if (fnmatch(names_[name].c_str(), own.c_str(), FNM_PERIOD) == 0) take(at / own);
    }
  }

 private:
  const Names& names_;
  std::set<fs::path> found_;
  std::set<std::pair<size_t, fs::path>> seen_;
};

}  // namespace

bool is_pattern(const std::string& text) { return text.find_first_of("*?[") != std::string::npos; }

std::vector<fs::path> files_matching(const fs::path& folder, const std::string& pattern) {
  const fs::path path = pattern;
  Names names;
  for (const fs::path& name : path.relative_path()) {
    if (name.empty() || name == ".") continue;
    if (name == "**" && !names.empty() && names.back() == "**") continue;  // ** after ** adds nothing
    names.push_back(name.string());
  }
  Search search(names);
  if (!names.empty()) search.match(path.is_absolute() ? path.root_path() : folder, 0);
  return {search.found().begin(), search.found().end()};
}

}  // namespace nif::tools
