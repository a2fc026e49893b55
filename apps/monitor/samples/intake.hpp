// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <mutex>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "monitor/samples/arrival.hpp"
#include "monitor/samples/arrival_copy.hpp"
#include "monitor/samples/faults.hpp"
#include "monitor/samples/rate_check.hpp"
#include "monitor/samples/ring.hpp"

namespace resonid::monitor {

/// The signals of an axis.
enum class Channel : std::uint8_t { excitation, input, output, position };
inline constexpr std::size_t kChannels = 4;
inline constexpr EnumName<Channel> kChannelNames[] = {{Channel::excitation, "excitation"},
                                                      {Channel::input, "input"},
                                                      {Channel::output, "output"},
                                                      {Channel::position, "position"}};
[[nodiscard]] constexpr std::span<const EnumName<Channel>> enum_names(Channel) noexcept {
  return kChannelNames;
}

/// [channel] The column of a source that is this channel; empty: the axis has no such channel.
using ColumnNames = std::array<std::string, kChannels>;

/// Channels of the ring of an axis with these columns, in its order.
[[nodiscard]] std::vector<std::string> ring_channels(const ColumnNames& columns);

/// Samples of an axis since the start of the process.
struct SampleCounters {
  std::atomic<std::uint64_t> samples{0};    ///< Taken, those that are not finite included.
  std::atomic<std::uint64_t> missing{0};    ///< Never came in time, or are not finite.
  std::atomic<std::uint64_t> late{0};       ///< Came after later ones, and were left out.
  std::atomic<std::uint64_t> duplicate{0};  ///< Came again, and were left out.
  std::atomic<std::uint64_t> lost{0};  ///< Came and could not be used, or were lost on the way by a source.
};

/// Takes what arrives for one axis into its ring: columns become channels, what comes twice is left out, gaps
/// of up to a second are filled with missing samples and longer ones skipped. A gap of more than 10 s and 1.1
/// times what passed meanwhile, by the sender's time or without by the host's clock, counts once a second
/// message goes on from it; the first one is refused until then, kept in the file RING.kept, and taken before
/// the second. The sender's clock is followed as far as it can be believed: a jump beyond some seconds counts
/// once the messages of three seconds agree with it, or the host's clock does. Time goes back only where the
/// clock was far ahead, and past a gap. Values stay as they came. What is wrong is counted and named, a rate
/// too that is not the axis' own by the sender's times or, without, by when its samples come; nothing throws.
///
/// A sender that numbers its samples gets every sample exactly once. One that does not is taken to send
/// consecutive samples, and each message once by the position that its source tells. For any thread.
class Intake {
 public:
  /// `ring` outlives this; its channels are ring_channels(columns).
  Intake(Ring& ring, ColumnNames columns);

  enum class Outcome {
    taken,
    duplicate,  ///< All of it is in the ring already.
    refused,    ///< Cannot be used; the faults tell why. After a gap that is not confirmed it is kept.
    full  ///< The reader is too far behind: less than a second is free. Nothing was taken or counted: to be
          ///< given again, or lost().
  };
  /// @param position of the source after this message; word 3 is taken from `arrival.ends` where there are
  /// any
  [[nodiscard]] Outcome add(const Arrival& arrival, const SourcePosition& position = {});

  /// Samples that a source knows to have been lost.
  void lost(std::uint64_t samples) noexcept { count(counters_.lost, samples); }
  /// Samples that a source has passed over, knowing that the ring has them.
  void passed_over(std::uint64_t samples) noexcept { count(counters_.duplicate, samples); }

  /// Index by the sender's count of the sample that is due, all before it being in the ring.
  [[nodiscard]] std::uint64_t next_for_sender() const;
  /// Where the source stood with the newest sample, or what it told by reached() since.
  [[nodiscard]] SourcePosition position() const;
  /// Where the ring stands: what goes on from there loses nothing that comes after.
  struct Progress {
    std::uint64_t next_sample = 0, sender_offset = 0;  ///< Ring::next_sample(), Ring::sender_offset()
    SourcePosition position;
  };
  [[nodiscard]] Progress progress() const;
  /// When the newest samples came, UNIX time (ns); 0: none came yet.
  [[nodiscard]] std::int64_t arrived_ns() const noexcept { return arrived_ns_; }
  /// The source has come so far, and all of this axis before it was given to add(). Not while a message waits
  /// for another to confirm its gap.
  void reached(const SourcePosition& position);
  [[nodiscard]] const SampleCounters& counters() const noexcept { return counters_; }
  /// Why the newest message was refused; empty where it was taken.
  [[nodiscard]] std::string refusal() const { return refused_ ? faults_.newest() : ""; }
  [[nodiscard]] FaultLog& faults() noexcept { return faults_; }
  [[nodiscard]] const FaultLog& faults() const noexcept { return faults_; }

 private:
  /// Where and when the samples of a message go.
  struct Place {
    std::uint64_t sample = 0;   ///< Index of the first sample that is put.
    std::uint64_t skipped = 0;  ///< Samples at the beginning of the message that are left out.
    std::uint64_t offset = 0;   ///< From the sender's count to the index.
    bool restarted = false;
    std::optional<std::int64_t> time_ns;  ///< Told, of that sample.
  };
  /// An anchor to put before the samples.
  struct Clock {
    bool anchor = false;
    std::optional<std::int64_t> time_ns;
    std::optional<double> interval_ns;
    std::string fault = {};
    double deviation_ns = 0.0;  ///< That is left.
  };
  /// What is made of a told time.
  enum class Trust {
    believed,
    doubted,  ///< Far from what is due, and nothing confirms it: the ring's clock goes on.
    anew      ///< The ring's clock is far ahead: it begins anew after a gap.
  };
  /// A message that was refused, since it is far ahead of what was due.
  struct Far {
    ArrivalCopy message;
    SourcePosition position;
    std::uint64_t first = 0, samples = 0;  ///< By the sender, without those that the ring had.
  };
  /// A time far from what is due, that messages tell since then.
  struct Claim {
    std::uint64_t sample = 0;
    std::int64_t time_ns = 0;
  };

  static void count(std::atomic<std::uint64_t>& counter, std::uint64_t by) noexcept {
    counter.fetch_add(by, std::memory_order_relaxed);
  }
  [[nodiscard]] Outcome take(const Arrival& arrival, const SourcePosition& position, bool sure = false);
  [[nodiscard]] Outcome take_far();
  [[nodiscard]] bool goes_on_from_far(std::uint64_t first) const;
  void keep_far(const Arrival& arrival, const SourcePosition& position, std::uint64_t before);
  void write_far() const;
  void read_far();
  void forget_far();
  [[nodiscard]] std::uint64_t come_before(const Arrival& arrival, const SourcePosition& position) const;
  [[nodiscard]] bool usable(const Arrival& arrival, std::uint64_t left);
  [[nodiscard]] bool map_columns(const Arrival& arrival);
  [[nodiscard]] std::optional<Place> place_of(const Arrival& arrival, std::uint64_t skipped);
  [[nodiscard]] bool likely(const Place& place) const;
  [[nodiscard]] bool restarts(const Place& place, std::uint64_t samples);
  void leave_out(std::uint64_t from, std::uint64_t to);
  [[nodiscard]] Trust trust_in(const Place& place, std::uint64_t gap);
  [[nodiscard]] bool confirmed(std::uint64_t sample, std::int64_t told_ns);
  void begin_anew(Place& place);
  [[nodiscard]] Clock clock_at(const Place& place, std::uint64_t gap, bool jump, Trust trust) const;
  [[nodiscard]] std::optional<std::int64_t> time_of(std::uint64_t sample) const;
  void put_values(const Arrival& arrival, const Place& place);
  void check_rate(const Place& place, std::uint64_t end);

  Ring& ring_;
  ColumnNames names_;                          ///< [ring channel], the unused ones at the end empty
  std::vector<std::string> columns_;           ///< Of the last message.
  std::array<std::size_t, kChannels> from_{};  ///< [ring channel] Column of these.
  bool mapped_ = false;
  std::deque<std::pair<std::uint64_t, std::uint64_t>>
      gaps_;  ///< Newest indices that never came: [first, last).
  std::uint64_t again_next_ = 0,
                again_ = 0;  ///< A run of samples that are there: the next one, their number.
  std::filesystem::path far_file_;
  std::optional<Far> far_;
  double deviation_ns_ = 0.0;  ///< Told time less that of the ring, of the last message.
  std::optional<std::pair<std::uint64_t, std::int64_t>> told_;  ///< Sample and time of the last message.
  std::optional<Claim> claim_;
  std::uint64_t clock_anchor_;  ///< Sample of the newest anchor.
  RateCheck told_rate_, arrival_rate_;
  bool not_finite_ = false;           ///< The newest sample.
  std::atomic<bool> refused_{false};  ///< The newest message.
  std::atomic<std::int64_t> arrived_ns_{0};
  std::vector<double> values_;
  mutable std::mutex mutex_;
  SampleCounters counters_;
  FaultLog faults_;
};

}  // namespace resonid::monitor
