// Starts `nif` with posix_spawn, with its outputs in files, and checks every 5 ms whether it has ended. Pipes
// could fill up and block. A run that takes too long is killed, and the test fails.
#include "tests/cli/program.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <regex>
#include <thread>

namespace nif::test {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPoll{5};

}  // namespace

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

Process::Process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                 const std::filesystem::path& out)
    : out_(out.empty() ? folder_.path() / "out" : out), err_(folder_.path() / "err") {
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  // Makes every line of progress appear, because tests wait for it; a log omits some.
  ::setenv("NIF_PROGRESS", "all", 0);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr int kWrite = O_WRONLY | O_CREAT | O_TRUNC;
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, out_.c_str(), kWrite, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, err_.c_str(), kWrite, 0600);
  const int error = posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    pid_ = -1;
    ADD_FAILURE() << program << " cannot be started: " << std::strerror(error);
  }
}

Process::~Process() {
  if (!running()) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, &status_, 0);
}

bool Process::running() {
  if (pid_ > 0 && ::waitpid(pid_, &status_, WNOHANG) != 0) pid_ = -1;
  return pid_ > 0;
}

bool Process::wait_for_error_text(const std::string& text) {
  const auto start = Clock::now();
  while (seconds_since(start) < 60) {
    const bool more = running();
    if (read_bytes(err_).find(text) != std::string::npos) return true;
    if (!more) return false;
    std::this_thread::sleep_for(kPoll);
  }
  return false;
}

void Process::send(int signal) const {
  if (pid_ > 0) ::kill(pid_, signal);
}

Outcome Process::finish(double seconds) {
  const auto start = Clock::now();
  while (running()) {
    if (seconds_since(start) > seconds) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, &status_, 0);
      pid_ = -1;
      ADD_FAILURE() << "killed after " << seconds << " s";
    }
    std::this_thread::sleep_for(kPoll);
  }
  const int code = WIFSIGNALED(status_) ? 128 + WTERMSIG(status_) : WEXITSTATUS(status_);
  const bool device = !std::filesystem::is_regular_file(out_);
  return {code, device ? "" : read_bytes(out_), read_bytes(err_)};
}

Outcome nif(const std::vector<std::string>& arguments) { return Process(nif_path(), arguments).finish(); }

std::filesystem::path nif_path() { return NIF_EXECUTABLE; }

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

bool is_progress(const std::string& line) {
  static const std::regex form("^ *[0-9]{1,3} %  .*");
  return std::regex_match(line, form);
}

std::vector<std::string> without_progress(const std::string& err) {
  std::vector<std::string> lines = lines_of(err);
  std::erase_if(lines, is_progress);
  return lines;
}

std::vector<std::string> listing(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

void expect_parts_add_up(const nlohmann::json& bytes) {
  uint64_t in_file = 0, resident = 0;
  for (const nlohmann::json& part : bytes["parts"]) {
    in_file += part["file"].get<uint64_t>();
    resident += part["resident"].get<uint64_t>();
  }
  EXPECT_EQ(in_file, bytes["file"]);
  EXPECT_EQ(resident, bytes["resident"]);
}

}  // namespace nif::test
