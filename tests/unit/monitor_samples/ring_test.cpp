// SPDX-License-Identifier: MIT
#include "monitor/samples/ring.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <memory>
#include <random>
#include <resonid/base/error_text.hpp>
#include <thread>

#include "../io/temporary_folder.hpp"

namespace resonid::monitor {
namespace {

using test::TemporaryFolder;
namespace fs = std::filesystem;

const RingSettings kSmall{"x", {"excitation", "input", "output"}, 1000.0, 1000};

std::unique_ptr<Ring> opened(const fs::path& path, const RingSettings& settings = kSmall) {
  auto ring = Ring::open(path, settings);
  if (!ring) throw std::runtime_error(message_of(ring.error()));
  return std::move(*ring);
}

/// What sample `index` must have in a channel.
double truth(std::uint64_t index, std::size_t channel) {
  return 4.0 * static_cast<double>(index) + static_cast<double>(channel);
}

std::vector<double> samples(std::uint64_t first, std::uint64_t count, std::size_t channels = 3) {
  std::vector<double> values;
  for (std::uint64_t k = first; k < first + count; ++k)
    for (std::size_t c = 0; c < channels; ++c) values.push_back(truth(k, c));
  return values;
}

void append(Ring& ring, std::uint64_t count, std::uint64_t position = 1) {
  if (ring.end() == 0 && ring.next_sample() == 0) ring.put_anchor(0, std::nullopt);
  ring.put(samples(ring.next_sample(), count));
  ring.commit({{7, 0, 0, position}});
}

/// Reads everything from `position` on, and checks it against truth().
std::uint64_t checked_until(const Ring& ring, std::uint64_t position) {
  while (true) {
    const Piece piece = ring.piece(position);
    if (piece.samples == 0) return position;
    EXPECT_EQ(piece.position, position);
    for (std::size_t k = 0; k < piece.samples; ++k)
      for (std::size_t c = 0; c < 3; ++c)
        if (piece.values[3 * k + c] != truth(piece.first_sample + k, c)) {
          ADD_FAILURE() << "position " << position + k;
          return position;
        }
    position += piece.samples;
  }
}

TEST(Ring, GivesBackWhatWasPutAroundItsEnd) {
  const TemporaryFolder folder;
  const auto ring = opened(folder / "x.ring");
  std::uint64_t read = 0;
  for (int k = 0; k < 100; ++k) {
    ASSERT_TRUE(ring->room(97)) << k;
    append(*ring, 97);
    read = checked_until(*ring, read);
    ASSERT_EQ(read, ring->end());
    ring->set_read(read);
  }
  EXPECT_EQ(read, 9700U);
  EXPECT_EQ(ring->next_sample(), 9700U);
}

TEST(Ring, NothingIsSeenBeforeItIsCommitted) {
  const TemporaryFolder folder;
  const auto ring = opened(folder / "x.ring");
  ring->put_anchor(0, 5);
  ring->put(samples(0, 3));
  EXPECT_EQ(ring->end(), 0U);
  EXPECT_EQ(ring->piece(0).samples, 0U);
  ring->commit({});
  EXPECT_EQ(ring->piece(0).samples, 3U);
}

TEST(Ring, GapsAndTimesAreKept) {
  const TemporaryFolder folder;
  auto ring = opened(folder / "x.ring");
  ring->put_anchor(10, 1'000'000'000);
  ring->put(samples(10, 5));
  ring->put_missing(2);
  ring->put(samples(17, 1));
  ring->put_anchor(5000, 7'000'000'000, 2e6);
  ring->put(samples(5000, 4));
  ring->commit({{1, 2, 3, 4}}, 99);
  for (int opening = 0; opening < 2; ++opening) {
    const Piece first = ring->piece(1);
    EXPECT_EQ(first.first_sample, 11U);
    EXPECT_EQ(first.samples, 7U);
    EXPECT_EQ(first.time_ns, 1'001'000'000);
    EXPECT_TRUE(std::isnan(first.values[3 * 4]) && std::isnan(first.values[3 * 5 + 2]));
    EXPECT_EQ(first.values[3 * 6], truth(17, 0));
    const Piece second = ring->piece(9);
    EXPECT_EQ(second.first_sample, 5001U);
    EXPECT_EQ(second.samples, 3U);
    EXPECT_EQ(second.time_ns, 7'002'000'000);
    EXPECT_EQ(ring->next_sample(), 5004U);
    EXPECT_EQ(ring->next_time_ns(), 7'008'000'000);
    EXPECT_EQ(ring->source(), (SourcePosition{{1, 2, 3, 4}}));
    EXPECT_EQ(ring->sender_offset(), 99U);
    EXPECT_EQ(ring->position_of(0), 0U);
    EXPECT_EQ(ring->position_of(12), 2U);
    EXPECT_EQ(ring->position_of(100), 8U);
    EXPECT_EQ(ring->position_of(5002), 10U);
    EXPECT_EQ(ring->position_of(9000), ring->end());
    ring.reset();
    ring = opened(folder / "x.ring");
  }
}

TEST(Ring, SaysFullRatherThanOverwriteWhatIsUnread) {
  const TemporaryFolder folder;
  const auto ring = opened(folder / "x.ring");
  while (ring->room(10)) append(*ring, 10);
  EXPECT_EQ(ring->end(), 750U);
  EXPECT_EQ(checked_until(*ring, 0), 750U);
  ring->set_read(10);
  EXPECT_TRUE(ring->room(10));
  EXPECT_FALSE(ring->room(11));
  append(*ring, 10);
  EXPECT_FALSE(ring->room(1));
  EXPECT_EQ(ring->begin(), 10U);
  EXPECT_EQ(ring->piece(0).position, 10U);
  ring->set_read(760);
  EXPECT_TRUE(ring->room(250));
  EXPECT_FALSE(ring->room(251));
}

TEST(Ring, AnchorsThatAreUnreadAreNotOverwritten) {
  const TemporaryFolder folder;
  const auto ring = opened(folder / "x.ring", {"x", {"excitation", "input", "output"}, 1000.0, 100'000});
  std::uint64_t jumps = 0;
  const auto jump = [&] {
    ring->put_anchor(10 * jumps, std::nullopt);
    ring->put(samples(10 * jumps++, 2));
    ring->commit({});
  };
  while (ring->room(2, 1)) jump();
  EXPECT_EQ(jumps, 1008U);
  EXPECT_EQ(checked_until(*ring, 0), 2 * jumps);
  ring->set_read(100);
  while (ring->room(2, 1)) jump();
  EXPECT_EQ(jumps, 1058U);
  EXPECT_EQ(ring->begin(), 100U);
  EXPECT_EQ(checked_until(*ring, 100), 2 * jumps);
  EXPECT_FALSE(ring->room(0, 17));
}

TEST(Ring, IsTheSameAfterOpeningAgainAndStartsUnread) {
  const TemporaryFolder folder;
  {
    const auto ring = opened(folder / "x.ring");
    for (int k = 0; k < 40; ++k) {
      append(*ring, 50, static_cast<std::uint64_t>(k));
      ring->set_read(ring->end());
    }
  }
  const auto ring = opened(folder / "x.ring");
  EXPECT_EQ(ring->end(), 2000U);
  EXPECT_EQ(ring->source().word[3], 39U);
  EXPECT_EQ(ring->begin(), 1250U);
  EXPECT_EQ(ring->read(), 1250U);
  EXPECT_FALSE(ring->room(1));
  EXPECT_EQ(checked_until(*ring, ring->begin()), 2000U);
}

TEST(Ring, IsUsedByOneAtATime) {
  const TemporaryFolder folder;
  const auto ring = opened(folder / "x.ring");
  RESONID_EXPECT_MESSAGE(Ring::open(folder / "x.ring", kSmall), "another process uses");
  const ::pid_t child = ::fork();
  if (child == 0) ::_exit(Ring::open(folder / "x.ring", kSmall) ? 1 : 0);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(Ring, RefusesWhatIsNoneOrDamagedAndLeavesItAlone) {
  const TemporaryFolder folder;
  const std::string text = "time,ru,u,y\n0,1,2,3\n";
  const fs::path foreign = folder.file("foreign", text);
  RESONID_EXPECT_MESSAGE(Ring::open(foreign, kSmall), "no ring of samples");
  EXPECT_EQ(test::contents_of(foreign), text);
  RESONID_EXPECT_MESSAGE(Ring::open(folder.path(), kSmall), "cannot open");
  RESONID_EXPECT_MESSAGE(Ring::open("/dev/null", kSmall), "this is no file");
  RESONID_EXPECT_MESSAGE(Ring::open(folder / "none" / "x.ring", kSmall), "cannot open");

  { append(*opened(folder / "x.ring"), 20); }
  const std::string right = test::contents_of(folder / "x.ring");
  const auto refused = [&](const std::string& bytes) {
    return Ring::open(folder.file("wrong.ring", bytes), kSmall);
  };
  const auto flipped = [&](std::initializer_list<std::size_t> places) {
    std::string bytes = right;
    for (const std::size_t at : places) bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    return bytes;
  };
  EXPECT_TRUE(refused(right));
  RESONID_EXPECT_MESSAGE(refused(right.substr(0, right.size() - 4096)), "it was cut");
  RESONID_EXPECT_MESSAGE(refused(std::string(right.size(), '\0')), "begins with zeros");
  RESONID_EXPECT_MESSAGE(refused(right.substr(0, 100)), "header of this ring of samples is damaged");
  RESONID_EXPECT_MESSAGE(refused(flipped({17})), "header of this ring of samples is damaged");
  RESONID_EXPECT_MESSAGE(refused(flipped({4096 + 16, 4096 + 256 + 16})), "both commits are damaged");
  RESONID_EXPECT_MESSAGE(refused(flipped({8192 + 8})), "wrong anchors");
  // The older commit alone does no harm; without the newest one, the state is that before it.
  EXPECT_EQ((*refused(flipped({4096 + 256 + 16})))->end(), 20U);
  EXPECT_EQ((*refused(flipped({4096 + 16})))->end(), 0U);
}

TEST(Ring, RefusesOtherSettings) {
  const TemporaryFolder folder;
  { opened(folder / "x.ring"); }
  RingSettings other = kSmall;
  other.channels.pop_back();
  RESONID_EXPECT_MESSAGE(Ring::open(folder / "x.ring", other),
                         "axis 'x', excitation, input, output at 1000 Hz");
  other = kSmall;
  other.axis = "y";
  EXPECT_FALSE(Ring::open(folder / "x.ring", other));
  for (const auto& wrong : {RingSettings{"", {"u"}, 1.0, 100}, RingSettings{"x", {}, 1.0, 100},
                            RingSettings{"x", {"u"}, 0.0, 100}, RingSettings{"x", {"u"}, 1.0, 63}})
    EXPECT_FALSE(Ring::open(folder / "y.ring", wrong)) << wrong.axis;
  EXPECT_FALSE(fs::exists(folder / "y.ring"));
}

/// Samples are counted on, so that nothing that was told of an axis is told again.
TEST(Ring, OfOtherSettingsIsMadeAnewWhereThatIsAskedFor) {
  const TemporaryFolder folder;
  append(*opened(folder / "x.ring"), 20, 99);
  RingSettings longer = kSmall;
  longer.capacity = 2000;
  bool renewed = false;
  const auto renew = [&](const RingSettings& settings) {
    auto ring = Ring::open_or_renew(folder / "x.ring", settings, renewed);
    if (!ring) throw std::runtime_error(message_of(ring.error()));
    return std::move(*ring);
  };
  {
    const auto same = renew(kSmall);
    EXPECT_FALSE(renewed);
    EXPECT_EQ(same->end(), 20U);
    EXPECT_FALSE(Ring::open_or_renew(folder / "x.ring", longer, renewed)) << "somebody uses it";
  }
  {
    const auto ring = renew(longer);
    EXPECT_TRUE(renewed);
    EXPECT_EQ(ring->end(), 0U);
    EXPECT_EQ(ring->next_sample(), 20U);
    append(*ring, 500, 100);
  }
  const auto again = renew(longer);
  EXPECT_FALSE(renewed);
  EXPECT_EQ(again->next_sample(), 520U);
  EXPECT_EQ(again->source(), (SourcePosition{{7, 0, 0, 100}}));
  EXPECT_EQ(checked_until(*again, 0), 500U);
  EXPECT_FALSE(fs::exists(folder / "x.ring.new"));
  EXPECT_FALSE(Ring::open_or_renew(folder / "x.ring", {"x", {"u"}, 1.0, 63}, renewed));
}

TEST(Ring, ADamagedOneIsSetAsideAndBegunAnewWhereThatIsAskedFor) {
  const TemporaryFolder folder;
  { append(*opened(folder / "x.ring"), 20); }
  const std::string right = test::contents_of(folder / "x.ring");
  const auto flipped = [&](std::initializer_list<std::size_t> places) {
    std::string bytes = right;
    for (const std::size_t at : places) bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    return bytes;
  };
  RingSettings other = kSmall;
  other.capacity = 2000;
  int number = 0;
  bool renewed = false;
  for (const std::string& damaged :
       {std::string(right.size(), '\0'), right.substr(0, right.size() - 4096), flipped({17}),
        flipped({4096 + 16, 4096 + 256 + 16}), flipped({8192 + 8})})
    for (const RingSettings& settings : {kSmall, other}) {
      const fs::path path = folder.file("x.ring", damaged);
      fs::path aside = path;
      aside += ".damaged-" + std::to_string(++number);
      {
        const auto ring = Ring::open_or_renew(path, settings, renewed);
        ASSERT_TRUE(ring) << message_of(ring.error());
        EXPECT_NE((*ring)->set_aside().find(aside.string()), std::string::npos) << (*ring)->set_aside();
        EXPECT_EQ((*ring)->next_sample(), 0U);
        EXPECT_EQ(test::contents_of(aside), damaged);
        append(**ring, 5);
      }
      const auto again = Ring::open_or_renew(path, settings, renewed);
      ASSERT_TRUE(again);
      EXPECT_EQ((*again)->next_sample(), 5U);
      EXPECT_TRUE((*again)->set_aside().empty());
    }
  const std::string text = "time,ru,u,y\n0,1,2,3\n";
  const fs::path foreign = folder.file("foreign", text);
  RESONID_EXPECT_MESSAGE(Ring::open_or_renew(foreign, kSmall, renewed), "no ring of samples");
  EXPECT_EQ(test::contents_of(foreign), text);
}

TEST(Ring, AFullDiskIsAnErrorAtOpening) {
  const TemporaryFolder folder;
  const ::pid_t child = ::fork();
  if (child == 0) {  // a limit of the process stands for that of the disk
    std::signal(SIGXFSZ, SIG_IGN);
    const ::rlimit limit{40'000, 40'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const auto ring = Ring::open(folder / "x.ring", kSmall);
    ::_exit(!ring && message_of(ring.error()).find("cannot take") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(fs::file_size(folder / "x.ring"), 0U);
  EXPECT_EQ(opened(folder / "x.ring")->end(), 0U);  // there is room again
}

TEST(Ring, WhoseMakingWasInterruptedIsMadeAnew) {
  const TemporaryFolder folder;
  for (const std::string& left :
       {std::string(), std::string("RSNRING0"), "RSNRING0" + std::string(500'000, '\x55')}) {
    const fs::path path = folder.file("x.ring", left);
    append(*opened(path), 20);
    EXPECT_EQ(checked_until(*opened(path), 0), 20U);
  }
}

/// The k-th message of the test below: a gap, then samples.
struct ScriptedMessage {
  std::uint64_t gap = 0, count = 0;
};
ScriptedMessage scripted(std::uint64_t k) {
  std::minstd_rand random(static_cast<unsigned>(k * 2'654'435'761U % 2'147'483'647U + 1));
  random.discard(3);
  const std::uint64_t gap = random() % 5 == 0 ? random() % 60 : random() % 50 == 0 ? 2000 : 0;
  return {gap, random() % 40};
}

/// Puts message after message until it is killed; tells each that is committed.
[[noreturn]] void write_for_ever(const fs::path& path, std::atomic<std::uint64_t>& told) {
  const auto ring = opened(path);
  for (std::uint64_t k = ring->source().word[3] + 1;; ++k) {
    ring->set_read(ring->end());
    const auto [gap, count] = scripted(k);
    if (gap > 50 || k == 1)
      ring->put_anchor(ring->next_sample() + gap, std::nullopt);
    else
      ring->put_missing(gap);
    std::uint64_t next = ring->next_sample() + gap;
    for (std::uint64_t i = 0; i < count; ++i, ++next) ring->put(samples(next, 1));
    ring->commit({{7, 7, 0, k}});
    told.store(k);
  }
}

TEST(Ring, SurvivesSigkillAtAnyInstant) {
  const TemporaryFolder folder;
  const fs::path path = folder / "x.ring";
  void* const shared = ::mmap(nullptr, sizeof(std::atomic<std::uint64_t>), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  auto& told = *new (shared) std::atomic<std::uint64_t>(0);
  struct Stored {
    std::uint64_t sample;
    bool missing;
  };
  std::deque<Stored> stored;  // what the ring must have: as scripted, without any ring
  std::uint64_t messages = 0, end = 0, next_sample = 0;
  std::mt19937 random(5);
  for (int run = 0; run < 400; ++run) {
    const ::pid_t child = ::fork();
    if (child == 0) write_for_ever(path, told);
    const auto latest = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (told.load() <= messages && run % 8 != 0 && std::chrono::steady_clock::now() < latest)
      std::this_thread::yield();  // the others die while they begin
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 2500));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const auto ring = opened(path);
    const std::uint64_t reached = ring->source().word[3];
    ASSERT_GE(reached, told.load()) << run;
    ASSERT_LE(reached, std::max(told.load(), messages) + 1);  // one of each process may not be told yet
    for (; messages < reached; ++messages) {
      const auto [gap, count] = scripted(messages + 1);
      if (gap <= 50 && messages > 0)
        for (std::uint64_t k = 0; k < gap; ++k) stored.push_back({next_sample + k, true});
      next_sample += gap;
      for (std::uint64_t k = 0; k < count; ++k) stored.push_back({next_sample++, false});
      end += gap <= 50 && messages > 0 ? gap + count : count;
      while (stored.size() > 1000) stored.pop_front();
    }
    ASSERT_EQ(ring->end(), end) << run;
    ASSERT_EQ(ring->next_sample(), next_sample);
    ASSERT_LE(ring->end() - ring->begin(), stored.size());
    ASSERT_TRUE(end < 750 || ring->end() - ring->begin() == 750);
    std::size_t at = stored.size() - (ring->end() - ring->begin());
    for (std::uint64_t position = ring->begin(); position < ring->end();) {
      const Piece piece = ring->piece(position);
      ASSERT_GT(piece.samples, 0U);
      for (std::size_t k = 0; k < piece.samples; ++k, ++at) {
        ASSERT_EQ(piece.first_sample + k, stored[at].sample) << run;
        for (std::size_t c = 0; c < 3; ++c) {
          const double value = piece.values[3 * k + c];
          ASSERT_TRUE(stored[at].missing ? std::isnan(value) : value == truth(stored[at].sample, c)) << run;
        }
      }
      position += piece.samples;
    }
  }
  EXPECT_GT(messages, 400U);
  RecordProperty("messages", std::to_string(messages));
  ::munmap(shared, sizeof(std::atomic<std::uint64_t>));
}

TEST(Ring, OneWritesOneReadsOneCopies) {
  const TemporaryFolder folder;
  const auto ring = opened(folder / "x.ring");
  constexpr std::uint64_t kSamples = 200'000;
  std::atomic<bool> done{false};
  std::thread writer([&] {
    std::minstd_rand random(1);
    while (ring->end() < kSamples) {
      const std::uint64_t count = 1 + random() % 60, gap = random() % 10 == 0 ? 500 : 0;
      if (!ring->room(count, 1)) {
        std::this_thread::yield();
        continue;
      }
      if (gap != 0 || ring->end() == 0) ring->put_anchor(ring->next_sample() + gap, std::nullopt);
      ring->put(samples(ring->next_sample() + gap, count));
      ring->commit({});
    }
  });
  std::uint64_t copies = 0;
  std::thread other([&] {
    std::vector<double> values;
    std::minstd_rand random(2);
    while (!done) {
      const std::uint64_t begin = ring->begin(), end = ring->end();
      const Piece piece = ring->copy(begin + random() % (end - begin + 1), 200, values);
      for (std::size_t i = 0; i < piece.values.size(); ++i)
        ASSERT_EQ(piece.values[i], truth(piece.first_sample + i / 3, i % 3));
      copies += piece.samples > 0 ? 1U : 0U;
    }
  });
  std::uint64_t read = 0;
  while (read < kSamples) {
    read = checked_until(*ring, read);
    ring->set_read(read);
    std::this_thread::yield();
  }
  done = true;
  writer.join();
  other.join();
  EXPECT_GT(copies, 0U);
}

}  // namespace
}  // namespace resonid::monitor
