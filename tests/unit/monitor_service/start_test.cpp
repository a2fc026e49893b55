// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <monitor/service/service.hpp>
#include <monitor/store/reader.hpp>
#include <resonid/base/error_text.hpp>

#include "folder.hpp"
#include "pulsed.hpp"

namespace resonid::monitor {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}
std::string contents_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// A service of one axis whose snapshot and source's position are stored.
class Starts : public ::testing::Test {
 protected:
  void run(std::uint64_t pulses_sent) {
    auto all = pulses_.installation(folder_.path(), {"x"});
    all.engine.stale_s = 1e6;
    const auto service = Service::start(std::move(all));
    ASSERT_TRUE(service) << message_of(service.error());
    for (std::uint64_t i = 0; i < pulses_sent; ++i) pulses_.send();
    for (int i = 0; i < 500 && (*service)->backend().axis("x")->status.samples.received < 10U * pulses_sent;
         ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    (*service)->stop();
  }
  [[nodiscard]] std::uint64_t next_sample() const {
    const auto at = Reader::open((folder_.path() / "monitor.sqlite").string())->position("x");
    return at && *at ? (*at)->next_sample : 0;
  }
  [[nodiscard]] fs::path ring() const { return folder_.path() / "rings" / "x.ring"; }
  [[nodiscard]] fs::path aside(int number) const {
    return ring().string() + ".damaged-" + std::to_string(number);
  }

  Folder folder_;
  Pulses pulses_;
};

TEST_F(Starts, ADamagedRingIsSetAsideAndItsSamplesAreCountedOn) {
  run(2);
  ASSERT_EQ(next_sample(), 20U);
  const std::string zeros(fs::file_size(ring()), '\0');
  write(ring(), zeros);
  run(1);
  EXPECT_EQ(next_sample(), 30U);
  EXPECT_EQ(contents_of(aside(1)), zeros);
  std::string damaged = contents_of(ring());
  damaged[17] = static_cast<char>(damaged[17] ^ 0x10);
  write(ring(), damaged);
  run(1);
  EXPECT_EQ(next_sample(), 40U);
  EXPECT_EQ(contents_of(aside(2)), damaged);
}

TEST_F(Starts, AFileThatIsNoRingIsRefusedAndLeftAsItIs) {
  run(1);
  const std::string text = "time,u,y\n0,1,2\n";
  write(ring(), text);
  const auto service = Service::start(pulses_.installation(folder_.path(), {"x"}));
  ASSERT_FALSE(service);
  EXPECT_NE(message_of(service.error()).find("no ring of samples"), std::string::npos);
  EXPECT_EQ(contents_of(ring()), text);
  EXPECT_FALSE(fs::exists(aside(1)));
}

}  // namespace
}  // namespace resonid::monitor
