// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <monitor/store/reader.hpp>
#include <monitor/store/store.hpp>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::monitor::test {

inline constexpr std::int64_t kSecond = 1'000'000'000;
inline constexpr std::int64_t kHour = 3600 * kSecond;
inline constexpr std::int64_t kStart = 1'767'225'600 * kSecond;  // 2026-01-01T00:00:00Z

/// A folder that goes with the test.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "resonid-store-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code code;
    std::filesystem::remove_all(path_, code);
  }
  [[nodiscard]] std::string file() const { return path_ + "/store.db"; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

inline Store opened(const std::string& path, const StoreOptions& options = {}) {
  auto store = Store::open(path, options);
  if (!store) throw std::runtime_error(store.error().text);
  return std::move(*store);
}

inline Reader reader_of(const std::string& path) {
  auto reader = Reader::open(path);
  if (!reader) throw std::runtime_error(reader.error().text);
  return std::move(*reader);
}

/// What a call returned; the test fails, and says why, where it returned an error.
template <class T>
T value(expected<T, StoreError> result) {
  if (result) return std::move(*result);
  ADD_FAILURE() << result.error().text;
  return T{};
}

inline monitoring::Row some_row(std::uint64_t sample, double resonance = 50.0) {
  monitoring::Row row;
  row.sample = sample;
  row.trusted = true;
  row.verdict = online::AxisVerdict::trusted;
  row[monitoring::Watched::resonance] = {resonance, 0.01};
  row[monitoring::Watched::stiffness] = {300.0 + 1e-6 * static_cast<double>(sample), 0.5};
  row.coherence = 0.99;
  return row;
}

inline RowRecord record_of(const std::string& axis, std::int64_t time_ns, const monitoring::Row& row) {
  return {axis, time_ns, row};
}

/// Upkeep until nothing is left to do.
inline int keep_up(Store& store, std::int64_t now_ns) {
  int steps = 0;
  for (;;) {
    const auto done = store.upkeep(now_ns);
    if (!done) {
      ADD_FAILURE() << done.error().text;
      return steps;
    }
    if (!done->more) return steps;
    ++steps;
  }
}

inline bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

inline bool same_bits(const monitoring::Row& a, const monitoring::Row& b) {
  bool same = a.sample == b.sample && a.trusted == b.trusted && a.verdict == b.verdict &&
              same_bits(a.lag_samples, b.lag_samples) && same_bits(a.coherence, b.coherence) &&
              same_bits(a.residual_rms, b.residual_rms) && a.gates.ready == b.gates.ready &&
              a.gates.excited == b.gates.excited && a.gates.converged == b.gates.converged &&
              a.gates.physical == b.gates.physical && a.gates.residual == b.gates.residual &&
              a.gates.complete == b.gates.complete && a.gates.covered == b.gates.covered;
  for (std::size_t i = 0; i < monitoring::kWatched; ++i)
    same = same && same_bits(a.figures[i].value, b.figures[i].value) &&
           same_bits(a.figures[i].std, b.figures[i].std);
  return same;
}

/// Any bits at all, some figures missing.
inline monitoring::Row any_row(std::mt19937_64& random) {
  const auto any_double = [&] {
    switch (random() % 4) {
      case 0:
        return std::numeric_limits<double>::quiet_NaN();
      case 1:
        return std::bit_cast<double>(random());  // infinities and other not-a-numbers among them
      case 2:
        return -0.0;
      default:
        return std::ldexp(static_cast<double>(random()), -60);
    }
  };
  monitoring::Row row;
  row.sample = random() >> 1U;
  for (auto& figure : row.figures) figure = {any_double(), any_double()};
  row.lag_samples = any_double();
  row.coherence = any_double();
  row.residual_rms = any_double();
  for (const auto gate :
       {&online::AxisGates::ready, &online::AxisGates::excited, &online::AxisGates::converged,
        &online::AxisGates::physical, &online::AxisGates::residual, &online::AxisGates::complete,
        &online::AxisGates::covered})
    row.gates.*gate = (random() & 1U) != 0;
  row.trusted = (random() & 1U) != 0;
  row.verdict = online::kAxisVerdictNames[random() % std::size(online::kAxisVerdictNames)].value;
  return row;
}

}  // namespace resonid::monitor::test
