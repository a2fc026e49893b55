// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include "brokers.hpp"

namespace resonid::monitor::test {
namespace {

/// What kill_test.cpp kills: a source and its ring, until the end.
[[noreturn]] void feed_until_killed(const std::string& kind, const std::string& where,
                                    const std::string& folder) {
  Rings rings(folder, {"x"});
  const auto source = kind == "mqtt" ? mqtt_source(static_cast<std::uint16_t>(std::stoi(where)), rings)
                                     : jetstream_source(where, rings);
  source->start();
  while (true) ::pause();
}

}  // namespace
}  // namespace resonid::monitor::test

int main(int count, char** arguments) {
  ::signal(SIGPIPE, SIG_IGN);
  if (count == 5 && std::string(arguments[1]) == "--feed")
    resonid::monitor::test::feed_until_killed(arguments[2], arguments[3], arguments[4]);
  ::testing::InitGoogleTest(&count, arguments);
  return RUN_ALL_TESTS();
}
