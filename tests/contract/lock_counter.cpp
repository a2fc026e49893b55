// SPDX-License-Identifier: MIT
#include "lock_counter.hpp"

#include <dlfcn.h>
#include <pthread.h>

#include <atomic>
#include <sanitized.hpp>

namespace {
std::atomic<std::size_t> count{0};
}

std::size_t resonid::test::locks() noexcept { return count; }

#if defined(__GLIBC__) && !RESONID_SANITIZED
namespace {
// The atomics below start from constants, so that they need no guards themselves.
template <class Function>
Function* behind(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}
}  // namespace

extern "C" {
int pthread_mutex_lock(pthread_mutex_t* mutex) {
  static std::atomic<int (*)(pthread_mutex_t*)> next{nullptr};
  if (next == nullptr) next = behind<int(pthread_mutex_t*)>("pthread_mutex_lock");
  ++count;
  return next.load()(mutex);
}
int __cxa_guard_acquire(long long* guard) {
  static std::atomic<int (*)(long long*)> next{nullptr};
  if (next == nullptr) next = behind<int(long long*)>("__cxa_guard_acquire");
  ++count;
  return next.load()(guard);
}
}
#endif
