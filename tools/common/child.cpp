// fork and exec with the output in memory files (memfd), so that no pipe can fill up. The child gets
// SIGTERM if its parent dies (PR_SET_PDEATHSIG). Nothing may allocate between fork and exec.
#include "tools/common/child.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "formats/base/status.hpp"

namespace nif::tools {

namespace {

[[noreturn]] void cannot_start() {
  throw Error(Status::internal, std::string("a nif process cannot be started: ") + std::strerror(errno));
}

}  // namespace

Child::Output::Output() : fd_(memfd_create("output of nif", MFD_CLOEXEC)) {
  if (fd_ < 0) cannot_start();
}

Child::Output::~Output() { close(fd_); }

std::string Child::Output::text() const {
  std::string text;
  char buffer[4096];
  for (ssize_t count; (count = pread(fd_, buffer, sizeof(buffer), off_t(text.size()))) > 0;)
    text.append(buffer, size_t(count));
  return text;
}

Child::Child(const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"nif"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  start("/proc/self/exe", words);
}

Child::Child(const std::vector<std::string>& words, const std::string& program) {
  start(program.c_str(), words);
}

void Child::start(const char* program, const std::vector<std::string>& arguments) {
  std::vector<char*> words;
  for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) cannot_start();
  if (pid_ > 0) return;
  // Nothing here may allocate: this process has copies of locks that other threads may hold.
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(kNoProgram);
  dup2(out_.fd(), STDOUT_FILENO);
  dup2(err_.fd(), STDERR_FILENO);
  execvp(program, words.data());
  _exit(kNoProgram);
}

Child::~Child() {
  if (pid_ < 0 || code_) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

std::optional<int> Child::ended() {
  if (code_) return code_;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) == pid_)
    code_ = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  return code_;
}

void Child::stop() {
  if (!code_) kill(pid_, SIGTERM);
}

}  // namespace nif::tools
