// SPDX-License-Identifier: MIT
#include <sys/wait.h>

#include <csignal>
#include <fstream>
#include <random>

#include "client.hpp"
#include "installation.hpp"
#include "monitor/sources/file_source.hpp"
#include "monitor/sources/tcp_source.hpp"

namespace resonid::monitor {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr int kKills = 100;
constexpr std::uint64_t kCapacity = 1U << 20U;

/// A process that runs `body` until it is killed.
template <class Body>
class Process {
 public:
  explicit Process(Body body) : process_(::fork()) {
    if (process_ != 0) return;
    body();
    while (true) ::pause();
  }
  void kill() const {
    ASSERT_EQ(::kill(process_, SIGKILL), 0);
    ASSERT_EQ(::waitpid(process_, nullptr, 0), process_);
  }

 private:
  ::pid_t process_;
};

class Killed : public ::testing::Test {
 protected:
  using Clock = std::chrono::steady_clock;

  /// Microseconds that a process lives: until `enough` went through them the longer the longer all takes, for
  /// on a busy machine they would be killed before they have begun.
  int lifetime_us(bool enough) {
    const int longer = enough ? 0 : static_cast<int>((Clock::now() - begin_) / std::chrono::seconds(3));
    return std::uniform_int_distribution(0, 30'000)(random_) * (1 + longer);
  }
  /// Whether one more is to be killed, the k-th: also on a busy machine until `enough` went through them.
  [[nodiscard]] bool goes_on(int k, bool enough) const {
    return k < kKills || (!enough && Clock::now() - begin_ < std::chrono::seconds(120));
  }
  bool one_in(int n) { return std::uniform_int_distribution(1, n)(random_) == 1; }

  const TemporaryFolder folder_;
  std::mt19937 random_{7};
  const Clock::time_point begin_ = Clock::now();
};

/// Lines without any numbering: a sample that was lost or came twice would shift all that follow.
TEST_F(Killed, AFileLosesAndDoublesNothing) {
  const fs::path path = folder_ / "x.csv";
  const std::vector<std::string> names{"a", "b"};
  const FileSettings settings{path, Format{}, 0.001};
  std::uint64_t written = 0, rotations = 0;
  std::ofstream file(path);
  file << "axis,u,y\n" << std::flush;
  {
    // What was renamed before any process stood in it is not looked for, and many die before they do on a
    // busy machine.
    Installation axes(folder_.path(), names, kCapacity);
    const auto source = required(make_file_source(settings, axes));
    source->start();
    ASSERT_TRUE(
        eventually([&] { return axes.intake("a").position().told() && axes.intake("b").position().told(); }));
  }
  const auto write = [&](int us) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::microseconds(us);
    do {
      for (int k = 0; k < 20; ++k, ++written) file << "a," << line_of(written) << "b," << line_of(written);
      const std::string half = "a," + line_of(written);
      file << half.substr(0, 3) << std::flush;
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      file << half.substr(3) << "b," << line_of(written) << std::flush;
      ++written;
      if (!one_in(100)) continue;
      fs::rename(path, folder_ / ("x.csv." + std::to_string(++rotations)));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));  // births are known to 4 ms
      file = std::ofstream(path);
      file << "axis,u,y\n";
    } while (std::chrono::steady_clock::now() < end);
  };
  const auto run = [&] {
    static std::unique_ptr<Installation> axes;
    static std::unique_ptr<Source> source;
    axes = std::make_unique<Installation>(folder_.path(), names, kCapacity);
    source = required(make_file_source(settings, *axes));
    source->start();
  };
  const auto enough = [&] { return written > 10'000 && rotations > 3; };
  for (int k = 0; goes_on(k, enough()); ++k) {
    const Process process(run);
    write(lifetime_us(enough()));
    process.kill();
    if (one_in(3)) write(1000);
  }
  file.close();
  Installation axes(folder_.path(), names, kCapacity);
  const auto source = required(make_file_source(settings, axes));
  source->start();
  ASSERT_TRUE(eventually([&] { return axes.end("a") >= written && axes.end("b") >= written; }))
      << axes.end("a") << " and " << axes.end("b") << " of " << written;
  axes.expect_exactly("a", written);
  axes.expect_exactly("b", written);
  EXPECT_GT(rotations, 3U);
  EXPECT_GT(written, 10'000U);
}

/// Sends frames, several on their way at a time, each until it is acknowledged, while `go_on`, which is told
/// how many samples there are; then what is left. Returns the number of samples, or nothing where an
/// acknowledgement told of samples that the next server did not have.
std::optional<std::uint64_t> send_acknowledged(const std::string& socket,
                                               const std::function<bool(std::uint64_t)>& go_on) {
  constexpr std::uint64_t kSamples = 20, kWindow = 5 * kSamples;
  std::uint64_t made = 0, acknowledged = 0;
  while (go_on(made) || acknowledged < made) {
    const Client client(socket);
    if (!client.connected()) {
      std::this_thread::sleep_for(std::chrono::microseconds(500));
      continue;
    }
    if (!client.send(encoded(Question{"x"}))) continue;
    auto next = client.next_sample("x");
    if (!next) continue;
    if (*next < acknowledged) return std::nullopt;
    acknowledged = *next;
    std::uint64_t sent = acknowledged;
    while (next && (go_on(made) || acknowledged < made)) {
      while (sent < acknowledged + kWindow && (sent < made || go_on(made))) {
        if (!client.send(frame_of("x", sent, kSamples))) break;
        sent += kSamples;
        made = std::max(made, sent);
      }
      next = client.next_sample("x");
      acknowledged = next.value_or(acknowledged);
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  }
  return made;
}

TEST_F(Killed, TcpLosesAndDoublesNothingThatTheClientKeepsUntilItIsAcknowledged) {
  const std::string socket = (folder_ / "socket").string();
  TcpSettings settings;
  settings.address = "unix:" + socket;
  const auto run = [&] {
    static std::unique_ptr<Installation> axes;
    static std::unique_ptr<Source> source;
    axes = std::make_unique<Installation>(folder_.path(), std::vector<std::string>{"x"}, kCapacity);
    source = required(make_tcp_source(settings, *axes));
    source->start();
  };
  const fs::path stop = folder_ / "stop", enough = folder_ / "enough", result = folder_ / "result";
  const ::pid_t sender = ::fork();
  if (sender == 0) {
    const auto made = send_acknowledged(socket, [&](std::uint64_t samples) {
      if (samples > 5000 && !fs::exists(enough)) std::ofstream(enough) << samples;
      return !fs::exists(stop);
    });
    std::ofstream(result) << (made ? std::to_string(*made) : "an acknowledged sample is gone");
    ::_exit(0);
  }
  for (int k = 0; goes_on(k, fs::exists(enough)); ++k) {
    const Process process(run);
    std::this_thread::sleep_for(std::chrono::microseconds(lifetime_us(fs::exists(enough))));
    process.kill();
  }
  std::ofstream(stop) << "now";
  Installation axes(folder_.path(), {"x"}, kCapacity);
  const auto source = required(make_tcp_source(settings, axes));
  source->start();
  ASSERT_EQ(::waitpid(sender, nullptr, 0), sender);
  const std::string made = test::contents_of(result);
  ASSERT_TRUE(!made.empty() && std::isdigit(static_cast<unsigned char>(made[0])) != 0) << made;
  EXPECT_GT(std::stoull(made), 5000U);
  axes.expect_exactly("x", std::stoull(made));
}

}  // namespace
}  // namespace resonid::monitor
