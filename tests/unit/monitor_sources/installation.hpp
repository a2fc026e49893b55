// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <resonid/base/error_text.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "../io/temporary_folder.hpp"
#include "monitor/samples/frame.hpp"
#include "monitor/sources/source.hpp"

namespace resonid::monitor {

inline constexpr double kTestRate_hz = 1000.0;

/// Axes with rings in a folder. Sample k that is sent as sent_sample() does has u = k/2 and y = -k.
class Installation final : public Axes {
 public:
  Installation(const std::filesystem::path& folder, const std::vector<std::string>& axes,
               std::uint64_t capacity = 1U << 16U, const ColumnNames& columns = {"", "u", "y", ""},
               double rate_hz = kTestRate_hz) {
    for (const std::string& name : axes) {
      auto ring = Ring::open(folder / (name + ".ring"), {name, ring_channels(columns), rate_hz, capacity});
      if (!ring) throw std::runtime_error(message_of(ring.error()));
      Axis& axis = axes_[name];
      axis.ring = std::move(*ring);
      axis.intake = std::make_unique<Intake>(*axis.ring, columns);
      all_.push_back(axis.intake.get());
    }
  }

  [[nodiscard]] Intake* find(std::string_view name) override {
    const auto at = axes_.find(std::string(name));
    return at == axes_.end() ? nullptr : at->second.intake.get();
  }
  [[nodiscard]] std::span<Intake* const> all() override { return all_; }

  [[nodiscard]] Intake& intake(const std::string& axis) { return *axes_.at(axis).intake; }
  [[nodiscard]] Ring& ring(const std::string& axis) { return *axes_.at(axis).ring; }
  [[nodiscard]] std::uint64_t end(const std::string& axis) { return ring(axis).end(); }
  void set_all_read(const std::string& axis) { ring(axis).set_read(ring(axis).end()); }

  /// Every sample [position][channel] that is there, and its index.
  struct Stored {
    std::vector<std::uint64_t> sample;
    std::vector<std::vector<double>> values;
  };
  [[nodiscard]] Stored stored(const std::string& axis) {
    Stored all;
    const Ring& r = ring(axis);
    for (std::uint64_t position = r.begin(); position < r.end();) {
      const Piece piece = r.piece(position);
      for (std::size_t k = 0; k < piece.samples; ++k) {
        all.sample.push_back(piece.first_sample + k);
        const auto row = piece.values.subspan(k * r.channels(), r.channels());
        all.values.emplace_back(row.begin(), row.end());
      }
      position += piece.samples;
    }
    return all;
  }
  /// Samples 0 ... count - 1 are there, each once and as sent_sample() tells, and nothing else.
  void expect_exactly(const std::string& axis, std::uint64_t count) {
    const Stored all = stored(axis);
    ASSERT_EQ(all.sample.size(), count) << axis;
    for (std::uint64_t k = 0; k < count; ++k) {
      ASSERT_EQ(all.sample[k], k) << axis;
      ASSERT_EQ(all.values[k][0], 0.5 * static_cast<double>(k)) << axis << ", sample " << k;
      ASSERT_EQ(all.values[k][1], -static_cast<double>(k)) << axis << ", sample " << k;
    }
  }

 private:
  struct Axis {
    std::unique_ptr<Ring> ring;
    std::unique_ptr<Intake> intake;
  };
  std::map<std::string, Axis> axes_;
  std::vector<Intake*> all_;
};

/// A frame of `count` samples of which the first has this index.
inline std::string frame_of(std::string_view axis, std::uint64_t first, std::size_t count,
                            double rate_hz = kTestRate_hz) {
  static constexpr std::string_view kColumns[] = {"y", "u"};
  std::vector<double> values;
  for (std::size_t k = 0; k < count; ++k) {
    const auto sample = static_cast<double>(first + k);
    values.insert(values.end(), {-sample, 0.5 * sample});
  }
  Arrival arrival;
  arrival.axis = axis;
  arrival.first_sample = first;
  arrival.sample_rate_hz = rate_hz;
  arrival.columns = kColumns;
  arrival.values = values;
  auto frame = encoded(arrival, ValueType::float64);
  if (!frame) throw std::runtime_error(message_of(frame.error()));
  return *frame;
}

/// A line u,y of the sample with this index.
inline std::string line_of(std::uint64_t sample) {
  return std::to_string(static_cast<double>(sample) / 2.0) + "," +
         std::to_string(-static_cast<double>(sample)) + "\n";
}
inline std::string lines_of(std::uint64_t first, std::uint64_t count) {
  std::string text;
  for (std::uint64_t k = first; k < first + count; ++k) text += line_of(k);
  return text;
}

/// Whether it becomes true within some seconds.
inline bool eventually(const std::function<bool()>& condition, double seconds = 20.0) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}
inline void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

/// What an expected has, or the test ends with its error.
template <class T>
T required(expected<T, Error> result) {
  if (!result) throw std::runtime_error(message_of(result.error()));
  return std::move(*result);
}

}  // namespace resonid::monitor
