// SPDX-License-Identifier: MIT
// A snapshot is a copy of the bytes: restored, here or in another process, it goes on bit for bit.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include "subject.hpp"

namespace resonid::test {
namespace {

/// What another process is told before the bytes.
struct Order {
  std::uint64_t which, from, to, size;
};

void write_all(int file, const void* from, std::size_t size) {
  const auto* next = static_cast<const char*>(from);
  while (size > 0) {
    const ssize_t done = ::write(file, next, size);
    if (done <= 0) throw std::runtime_error("pipe");
    next += done;
    size -= static_cast<std::size_t>(done);
  }
}
void read_all(int file, void* to, std::size_t size) {
  auto* next = static_cast<char*>(to);
  while (size > 0) {
    const ssize_t done = ::read(file, next, size);
    if (done <= 0) throw std::runtime_error("pipe");
    next += done;
    size -= static_cast<std::size_t>(done);
  }
}

/// The fingerprint of samples `from` ... `to` by a new process that gets the bytes and nothing else.
std::uint64_t resume_elsewhere(std::uint64_t which, std::span<const std::byte> bytes, std::uint64_t from,
                               std::uint64_t to) {
  std::array<int, 2> there{}, back{};
  if (pipe(there.data()) != 0 || pipe(back.data()) != 0) throw std::runtime_error("pipe");
  const pid_t child = fork();
  if (child == 0) {
    dup2(there[0], STDIN_FILENO);
    dup2(back[1], STDOUT_FILENO);
    for (const int file : {there[0], there[1], back[0], back[1]}) close(file);
    execl("/proc/self/exe", "test_contract", "--resume", nullptr);
    _exit(126);
  }
  close(there[0]);
  close(back[1]);
  const Order order{which, from, to, bytes.size()};
  write_all(there[1], &order, sizeof order);
  write_all(there[1], bytes.data(), bytes.size());
  close(there[1]);
  std::uint64_t fingerprint = 0;
  read_all(back[0], &fingerprint, sizeof fingerprint);
  close(back[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (status != 0) throw std::runtime_error("the other process failed");
  return fingerprint;
}

struct Choice {
  std::size_t which, at, more;
};
Choice any() {
  return {*rc::gen::inRange<std::size_t>(0, cases().size()), *rc::gen::inRange<std::size_t>(0, 6000),
          *rc::gen::inRange<std::size_t>(1, 1500)};
}

TEST(Snapshot, GoesOnBitForBit) {
  EXPECT_TRUE(rc::check("a copy restored into another object", [] {
    const Choice c = any();
    const auto whole = cases()[c.which].make(), restored = cases()[c.which].make();
    run(*restored, 17, 400);  // it held something else before
    run(*whole, 0, c.at);
    std::ranges::copy(whole->bytes(), restored->bytes().begin());
    RC_ASSERT(run(*restored, c.at, c.at + c.more) == run(*whole, c.at, c.at + c.more));
  }));
}

TEST(Snapshot, GoesOnBitForBitInAnotherProcess) {
  EXPECT_TRUE(rc::check("bytes through a pipe", [] {
    const Choice c = any();
    const auto whole = cases()[c.which].make();
    run(*whole, 0, c.at);
    const auto bytes = whole->bytes();
    const std::vector<std::byte> snapshot(bytes.begin(), bytes.end());
    const std::uint64_t expected = run(*whole, c.at, c.at + c.more);
    RC_ASSERT(resume_elsewhere(c.which, snapshot, c.at, c.at + c.more) == expected);
  }));
}

TEST(Snapshot, OfEveryEstimatorGoesOnInAnotherProcess) {
  for (std::size_t i = 0; i < cases().size(); ++i) {
    const auto whole = cases()[i].make();
    run(*whole, 0, 2345);
    const auto bytes = whole->bytes();
    const std::vector<std::byte> snapshot(bytes.begin(), bytes.end());
    EXPECT_EQ(resume_elsewhere(i, snapshot, 2345, 3000), run(*whole, 2345, 3000)) << cases()[i].name;
  }
}

TEST(Snapshot, OfOneSampleEarlierWouldBeSeen) {
  const auto whole = cases().back().make();
  run(*whole, 0, 2344);
  const auto bytes = whole->bytes();
  const std::vector<std::byte> earlier(bytes.begin(), bytes.end());
  run(*whole, 2344, 2345);
  EXPECT_NE(resume_elsewhere(cases().size() - 1, earlier, 2345, 3000), run(*whole, 2345, 3000));
}

}  // namespace

int resume_from_standard_input() {
  Order order{};
  read_all(STDIN_FILENO, &order, sizeof order);
  const auto subject = cases().at(order.which).make();
  if (subject->bytes().size() != order.size) return 2;
  read_all(STDIN_FILENO, subject->bytes().data(), order.size);
  const std::uint64_t result = run(*subject, order.from, order.to);
  write_all(STDOUT_FILENO, &result, sizeof result);
  return 0;
}

}  // namespace resonid::test
