// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <string>

namespace tendril::rt {

/// Runs a function in a forked child, where it may lock memory or give up rights for good, and returns what
/// it returned; the test fails where the child did not get that far.
template <class Function>
std::string in_child(Function function) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    close(ends[0]);
    const std::string answer = function();
    const bool sent = write(ends[1], answer.data(), answer.size()) == static_cast<ssize_t>(answer.size());
    _exit(sent ? 0 : 1);
  }
  close(ends[1]);
  std::string answer;
  char bytes[256];
  for (ssize_t got = 0; (got = read(ends[0], bytes, sizeof bytes)) > 0;)
    answer.append(bytes, static_cast<std::size_t>(got));
  close(ends[0]);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(status == 0);
  return answer;
}

/// The exit status of a child in which ThreadSanitizer found a race, its usual one.
inline constexpr int kChildRaced = 66;

/// Runs a function in a forked child that ends with kChildRaced where it races; whether it did. The function
/// returns whether its results were right. The child is silent: its races are expected.
template <class Function>
bool child_raced(Function function) {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
    _exit(function() ? 0 : 1);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  REQUIRE(WEXITSTATUS(status) != 1);
  return WEXITSTATUS(status) == kChildRaced;
}

/// Becomes a user without capabilities where the tests run as root; false where that fails.
inline bool give_up_root() {
  constexpr uid_t kNobody = 65534;
  return geteuid() != 0 || setresuid(kNobody, kNobody, kNobody) == 0;
}

}  // namespace tendril::rt
