// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/brokers/feed.hpp"

namespace resonid::monitor {

/// One axis that a topic, subject, stream or file seems to carry; `format` is empty where nothing could be
/// read.
struct Discovered {
  std::string name;    ///< Topic or subject; empty: of a file or a port.
  std::string stream;  ///< Of JetStream; empty: none.
  std::string axis;    ///< As the messages name it; empty: they do not.
  std::optional<SampleFormat> format;
  std::vector<std::string> columns;
  bool named = true;                         ///< The columns; else they are called "column 1" ...
  std::vector<std::vector<double>> samples;  ///< [column][sample] The first ones.
  std::uint64_t messages = 0, sample_count = 0;
  double told_rate_hz = 0.0;      ///< By the newest message; 0: not told.
  double timed_rate_hz = 0.0;     ///< By the sender's times; 0: not told, or fewer than two of them.
  double measured_rate_hz = 0.0;  ///< Samples per second of their arrival; 0: fewer than two messages.
  bool numbered = false;          ///< Samples have an index.
  bool timed = false;             ///< They have a time.

  /// As the sender tells it, else by its times; 0: neither. A column of times is better than the arrival.
  [[nodiscard]] double rate_hz() const noexcept { return told_rate_hz > 0.0 ? told_rate_hz : timed_rate_hz; }
};

/// Finds out what unknown messages carry. Remembers 10 000 axes, and of their first samples 4 million values.
class Scout {
 public:
  /// A whole message. @param time_s of arrival, of any origin
  void add(std::string_view name, std::string_view stream, std::string_view payload, double time_s);
  /// Samples that somebody else has read, which seem to be written so: with columns for numbers without
  /// names.
  void note(std::string_view name, std::string_view stream, const Format& guess, const Arrival& arrival,
            double time_s);
  /// By stream, name, axis.
  [[nodiscard]] std::vector<Discovered> found() const;

 private:
  struct Key {
    std::string stream, name, axis;
    auto operator<=>(const Key&) const = default;
  };
  struct Seen {
    Discovered what;
    double first_s = 0.0, last_s = 0.0;
    std::uint64_t samples_after_first = 0;
    std::optional<std::int64_t> first_ns, last_ns;
    std::uint64_t timed = 0, timed_before_last = 0;  ///< Samples since `first_ns`.
    std::uint64_t next_sample = 0;
  };
  [[nodiscard]] Seen* seen(Key key);
  void keep(Seen& seen, const Arrival& arrival);

  std::map<Key, Seen> seen_;
  std::size_t kept_values_ = 0;
};

/// The same for a stream of bytes, whose format is guessed from its beginning.
class ByteScout {
 public:
  /// Called for each frame and each question, which a client of TCP wants answered.
  using OnFrame = std::function<void(std::string_view axis)>;

  explicit ByteScout(Scout& scout, OnFrame on_frame = {}) : scout_(scout), on_frame_(std::move(on_frame)) {}
  ByteScout(const ByteScout&) = delete;
  ByteScout& operator=(const ByteScout&) = delete;

  void add(std::string_view bytes, double time_s);
  /// The stream ends, or the search.
  void finish(double time_s);

 private:
  void decide(double time_s);
  [[nodiscard]] Decoder::Take noting(double time_s);

  Scout& scout_;
  OnFrame on_frame_;
  FaultLog faults_;
  std::string head_;  ///< Until the format is known.
  Format guess_;
  std::optional<Decoder> decoder_;
};

}  // namespace resonid::monitor
