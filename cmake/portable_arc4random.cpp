// SPDX-License-Identifier: MIT
// libstdc++'s archive asks for arc4random, which glibc has since 2.36 only, on behalf of std::random_device,
// which nothing here uses: one of our own lets the portable programs run where glibc is older.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

extern "C" std::uint32_t arc4random() {
  std::uint32_t value = 0;
  if (getentropy(&value, sizeof value) != 0) std::abort();
  return value;
}
