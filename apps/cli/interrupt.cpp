// SPDX-License-Identifier: MIT
#include "interrupt.hpp"

#include <unistd.h>

#include <csignal>
#include <resonid/io/detail/atomic_file.hpp>
#include <thread>

#include "output.hpp"
#include "terminal.hpp"

namespace resonid::cli {
namespace {

constexpr int kEndedBySignal = 128;

bool is_ignored(int signal) {
  struct sigaction now {};
  return sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

/// Waits on a thread of its own, where everything may be called that a signal handler may not.
void wait_for(sigset_t signals) {
  int signal = 0;
  if (sigwait(&signals, &signal) != 0) return;
  io::remove_unfinished_files();
  ::_exit(ended_by(signal));
}

}  // namespace

int ended_by(int signal) {
  print_error(std::string(is_screen(STDERR_FILENO) ? "\r\x1b[K" : "") +
              (signal == SIGINT ? "resonid: interrupted\n" : "resonid: terminated\n"));
  return kEndedBySignal + signal;
}

void end_on_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  bool any = false;
  for (const int signal : {SIGINT, SIGTERM}) {
    if (is_ignored(signal)) continue;
    sigaddset(&signals, signal);
    any = true;
  }
  if (!any || pthread_sigmask(SIG_BLOCK, &signals, nullptr) != 0) return;
  std::thread(wait_for, signals).detach();
}

}  // namespace resonid::cli
