// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "case.hpp"
#include "platform.hpp"
#include "record.hpp"

namespace {

constexpr std::size_t kSamples = 4096;
constexpr std::size_t kReports = 4;
std::array<Sample, kSamples> samples;

/// What reading the clock and calling through a pointer cost.
[[gnu::noinline]] void nothing(const Sample&) { asm volatile("" ::: "memory"); }

struct Ticks {
  std::uint32_t total = 0;
  std::uint32_t largest = 0;
};

[[gnu::noinline]] Ticks timed(void (*step)(const Sample&), std::span<const Sample> part) {
  Ticks ticks;
  for (const Sample& s : part) {
    const std::uint32_t begin = clock_ticks();
    step(s);
    const std::uint32_t spent = clock_ticks() - begin;
    ticks.total += spent;
    ticks.largest = std::max(ticks.largest, spent);
  }
  return ticks;
}

}  // namespace

void Output::hex(std::uint32_t bits) {
  std::array<char, 10> text{' '};
  for (std::size_t i = 0; i < 8; ++i) text[1 + i] = "0123456789abcdef"[(bits >> (28U - 4U * i)) & 15U];
  write_text(text.data());
}

void Output::floats(const char* name, std::span<const float> values) {
  write_text("floats ");
  write_text(name);
  for (const float x : values) hex(std::bit_cast<std::uint32_t>(x));
  write_text("\n");
}

void Output::number(const char* name, std::uint32_t value) {
  write_text("number ");
  write_text(name);
  hex(value);
  write_text("\n");
}

int run(const Case& c) {
  make_record(c.injection, samples);
  start_clock();
  Output out;
  const Ticks overhead = timed(nothing, samples);
  const std::uint32_t begin = clock_ticks();
  if (!c.create()) return 1;
  const std::uint32_t create = clock_ticks() - begin;
  Ticks steps;
  constexpr std::size_t kPart = kSamples / kReports;
  for (std::size_t from = 0; from < kSamples; from += kPart) {
    const Ticks part = timed(c.step, std::span(samples).subspan(from, kPart));
    steps.total += part.total;
    steps.largest = std::max(steps.largest, part.largest);
    c.report(out);
  }
  out.number("samples", kSamples);
  out.number("overhead_ticks", overhead.total);
  out.number("create_ticks", create);
  out.number("step_ticks", steps.total);
  out.number("longest_step_ticks", steps.largest);
  out.number("state_bytes", static_cast<std::uint32_t>(c.state_bytes));
  return 0;
}
