// SPDX-License-Identifier: Apache-2.0
#include "tests/app/program/process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <thread>

extern char** environ;

namespace tendril::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kProcessPoll = std::chrono::milliseconds(2);

Clock::time_point after(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

int open_memory(const char* name) {
  const int fd = memfd_create(name, MFD_CLOEXEC);
  if (fd < 0) throw std::runtime_error(std::string("cannot make a file in memory: ") + std::strerror(errno));
  return fd;
}

/// The program writes through the same file description, so the file's offset is left alone.
std::string content(int fd) {
  std::string text;
  char bytes[4096];
  for (ssize_t got = 0; (got = pread(fd, bytes, sizeof bytes, static_cast<off_t>(text.size()))) > 0;)
    text.append(bytes, static_cast<std::size_t>(got));
  return text;
}

}  // namespace

Process::Process(std::vector<std::string> arguments)
    : name_(arguments[0]), out_(open_memory("out")), err_(open_memory("err")) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  int input[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, input) != 0)
    throw std::runtime_error(std::string("cannot make a pair of sockets: ") + std::strerror(errno));
  in_ = input[1];
  posix_spawn_file_actions_adddup2(&files, input[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, out_, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, err_, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int error = posix_spawnp(&pid_, argv[0], &files, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  close(input[0]);
  if (error != 0) {
    close(in_);
    close(out_);
    close(err_);
    throw std::runtime_error("cannot start " + arguments[0] + ": " + std::strerror(error));
  }
}

Process::~Process() {
  // Also what the program has started and not waited for; the group outlives its leader.
  kill(-pid_, SIGKILL);
  if (!status_) waitpid(pid_, nullptr, 0);
  close(in_);
  close(out_);
  close(err_);
}

void Process::send(int signal) {
  if (!wait(0)) kill(pid_, signal);
}

void Process::write_line(const std::string& line) {
  const std::string text = line + "\n";
  if (::send(in_, text.data(), text.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(text.size()))
    throw std::runtime_error("the program no longer reads");
}

std::optional<int> Process::wait(double seconds) {
  const auto deadline = after(seconds);
  while (!status_) {
    int status = 0;
    const bool ended = waitpid(pid_, &status, WNOHANG) == pid_;
    if (ended) {
      status_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
      note("ended with " + std::to_string(*status_));
    }
    if (ended || Clock::now() >= deadline) break;
    std::this_thread::sleep_for(kProcessPoll);
  }
  if (!status_ && seconds > 0) note("was waited for in vain: it has not ended");
  return status_;
}

bool Process::says(const std::string& text, double seconds) {
  const auto deadline = after(seconds);
  while (true) {
    const bool ended = wait(0).has_value();  // before the look, so that its last words are read
    if (out().find(text) != std::string::npos || err().find(text) != std::string::npos) return true;
    if (ended || Clock::now() >= deadline) {
      note("did not say '" + text + (ended ? "' before it ended" : "' in time"));
      return false;
    }
    std::this_thread::sleep_for(kProcessPoll);
  }
}

void Process::note(const std::string& what) const {
  UNSCOPED_INFO(name_ << " " << what << "; it said:\n" << out() << err());
}

std::string Process::out() const { return content(out_); }
std::string Process::err() const { return content(err_); }

Ended run(const std::vector<std::string>& arguments) {
  Process process(arguments);
  if (!process.wait()) process.send(SIGKILL);
  return {process.wait().value_or(-SIGKILL), process.out(), process.err()};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

}  // namespace tendril::app
