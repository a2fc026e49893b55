// SPDX-License-Identifier: MIT
// Steps under seccomp's strict mode, in which the kernel kills a process at any system call but read and
// write.
#include <gtest/gtest.h>

#include <sanitized.hpp>

#if defined(__linux__) && !RESONID_SANITIZED
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <functional>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

#include "subject.hpp"

namespace resonid::test {
namespace {

/// What wait() says of a child that does `work` and nothing else.
int status_of(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) != 0) syscall(SYS_exit, 77);
    work();
    syscall(SYS_exit, 0);  // _exit() would be another call, which is not allowed
  }
  int status = -1;
  waitpid(child, &status, 0);
  return status;
}

TEST(SystemCalls, AreNotMadeByAnyEstimator) {
  if (const int status = status_of([] {}); WIFEXITED(status) && WEXITSTATUS(status) == 77)
    GTEST_SKIP() << "no seccomp here";
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Case& c : cases()) {
    const auto subject = c.make(), other = c.make();
    subject->step(record(0));  // statics of the suite
    const int status = status_of([&] {
      run(*subject, 0, 3000);
      subject->step({kNan, kNan, kNan});
      subject->miss(100);
      std::copy(subject->bytes().begin(), subject->bytes().end(), other->bytes().begin());
      subject->reset();
      run(*other, 3000, 3500);
    });
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << c.name << " status " << status;
  }
}

TEST(SystemCalls, WouldBeSeen) {
  if (const int status = status_of([] {}); WIFEXITED(status) && WEXITSTATUS(status) == 77)
    GTEST_SKIP() << "no seccomp here";
  const auto killed = [](const std::function<void()>& work) {
    const int status = status_of(work);
    return WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
  };
  EXPECT_TRUE(killed([] { syscall(SYS_getpid); }));
  EXPECT_TRUE(killed([] { std::this_thread::sleep_for(std::chrono::microseconds(1)); }));
  EXPECT_TRUE(killed([] {
    const std::vector<int> memory(1U << 24U);  // more than the heap has at hand
    static_cast<void>(write(-1, memory.data(), 1));
  }));
}

}  // namespace
}  // namespace resonid::test
#endif
