// SPDX-License-Identifier: MIT
#include "monitor/samples/intake.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

#include "monitor/samples/crc32c.hpp"

namespace resonid::monitor {
namespace {

constexpr double kRateTolerance = 1e-3;
constexpr double kClockTolerance_ns = 1e8;  // what a sender's time may differ from its samples
constexpr double kSlewed_ns = 1e7;          // a clock that was ahead is in step again
constexpr double kSlewTime_ns = 1e10;       // in which a clock that is ahead is to fall into step
constexpr double kSecond_ns = 1e9;
constexpr double kJump_ns = 5e9;            // what a single message may change of the time
constexpr double kClaim_ns = 3e9;           // of samples that confirm a larger change
constexpr double kClaimTolerance_ns = 1e9;  // by which their times may waver
constexpr double kHostTolerance_ns = 60e9;  // a time that differs by less from the host's is of now
constexpr double kLongestSlew_ns = 600e9;   // a clock further ahead begins anew
constexpr double kDay_ns = 86'400e9;
constexpr std::uint64_t kMostIndex = std::uint64_t{1} << 62U;
constexpr std::int64_t kLatestTime = std::int64_t{1} << 62U;
constexpr std::size_t kMostGaps = 64;
constexpr double kRepetition_s = 10.0;  // longer ones of a sender without time are a restart
constexpr double kSuddenGap_s = 10.0;   // longer ones need as much time to have passed, or another message
constexpr double kGapPerTime = 1.1;     // seconds of samples in one of a clock
constexpr std::uint32_t kFarFormat = 1;

/// `time_ns` and so much later, not later than kLatestTime.
std::int64_t later(std::int64_t time_ns, double ns) noexcept {
  const auto left = static_cast<double>(kLatestTime - time_ns);
  return ns < left ? time_ns + std::llround(ns) : std::max(time_ns, kLatestTime);
}

/// UNIX time by the host's clock.
std::int64_t host_now_ns() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// By how much a time is off the host's clock.
double off_host_ns(std::int64_t time_ns) { return std::abs(static_cast<double>(time_ns - host_now_ns())); }

/// Sample at which the newest anchor of a ring stands; its oldest one where that anchor is overwritten.
std::uint64_t newest_anchor(const Ring& ring) {
  std::uint64_t sample = 0;
  for (std::uint64_t position = ring.begin(); position < ring.end();) {
    const Piece piece = ring.piece(position);
    // A piece begins at an anchor or where the ring's memory does.
    if (position == ring.begin() || position % ring.settings().capacity != 0) sample = piece.first_sample;
    position += piece.samples;
  }
  return sample;
}

}  // namespace

std::vector<std::string> ring_channels(const ColumnNames& columns) {
  std::vector<std::string> names;
  for (std::size_t c = 0; c < kChannels; ++c)
    if (!columns[c].empty()) names.emplace_back(kChannelNames[c].name);
  return names;
}

Intake::Intake(Ring& ring, ColumnNames columns)
    : ring_(ring),
      names_(std::move(columns)),
      far_file_(ring.path().string() + ".kept"),
      clock_anchor_(newest_anchor(ring)),
      told_rate_(ring.settings().sample_rate_hz),
      arrival_rate_(ring.settings().sample_rate_hz) {
  std::stable_partition(names_.begin(), names_.end(), [](const std::string& name) { return !name.empty(); });
  read_far();
}

std::uint64_t Intake::next_for_sender() const {
  const std::lock_guard lock(mutex_);
  return ring_.next_sample() - ring_.sender_offset();
}

SourcePosition Intake::position() const {
  const std::lock_guard lock(mutex_);
  return ring_.source();
}

Intake::Progress Intake::progress() const {
  const std::lock_guard lock(mutex_);
  return {ring_.next_sample(), ring_.sender_offset(), ring_.source()};
}

void Intake::reached(const SourcePosition& position) {
  const std::lock_guard lock(mutex_);
  if (!far_ && !position.at_or_before(ring_.source())) ring_.commit(position, ring_.sender_offset());
}

Intake::Outcome Intake::add(const Arrival& arrival, const SourcePosition& position) {
  const std::lock_guard lock(mutex_);
  const Outcome outcome = take(arrival, position);
  if (outcome == Outcome::taken || outcome == Outcome::refused) refused_ = outcome == Outcome::refused;
  if (outcome == Outcome::taken) arrived_ns_ = host_now_ns();
  return outcome;
}

/// @param sure a gap before it is confirmed
Intake::Outcome Intake::take(const Arrival& arrival, const SourcePosition& position, bool sure) {
  const std::uint64_t samples = arrival.samples(), before = come_before(arrival, position);
  if (samples == 0 && arrival.values.empty()) return Outcome::taken;
  if (before == samples && before > 0) {
    count(counters_.duplicate, samples);
    return Outcome::duplicate;
  }
  if (!usable(arrival, samples - before)) return Outcome::refused;
  // Its source gives it again after a kill or an interruption, which confirms nothing.
  if (far_ && position.told() && position.at_or_before(far_->position)) forget_far();
  const double rate = ring_.settings().sample_rate_hz;
  const std::uint64_t most = samples - before + static_cast<std::uint64_t>(rate);  // a gap filled included
  if (!ring_.room(std::min(most, ring_.most_samples()), 1)) return Outcome::full;
  if (far_ && arrival.first_sample && goes_on_from_far(*arrival.first_sample + before)) {
    // The same one again: from a sender that waits until it is taken.
    sure = *arrival.first_sample + before == far_->first && samples - before >= far_->samples;
    if (!sure) return take_far() == Outcome::full ? Outcome::full : take(arrival, position);
  }
  auto place = place_of(arrival, before);
  if (!place) {
    count(counters_.lost, samples - before);
    return Outcome::refused;
  }
  if (!sure && !likely(*place)) {
    keep_far(arrival, position, before);
    return Outcome::refused;
  }
  const std::uint64_t left = samples - place->skipped, next = ring_.next_sample();
  const std::uint64_t due = place->sample - place->skipped + before;  // by the message's first sample
  if (left == 0) {
    leave_out(due, due + samples - before);
    return Outcome::duplicate;
  }
  const bool first = ring_.end() == 0;
  const Trust trust = trust_in(*place, first ? 0 : place->sample - next);
  if (trust == Trust::anew) begin_anew(*place);
  const std::uint64_t gap = first ? 0 : place->sample - next;
  const bool fill =
      !place->restarted && static_cast<double>(gap) <= rate && gap + left <= ring_.most_samples();
  const std::uint64_t filled = fill ? gap : 0;
  Clock clock = clock_at(*place, gap, first || !fill, trust);
  if (place->skipped > before) leave_out(due, next);
  if (gap > 0) {
    count(counters_.missing, gap);
    gaps_.emplace_back(next, place->sample);
    if (gaps_.size() > kMostGaps) gaps_.pop_front();
  }
  ring_.put_missing(filled);
  if (clock.anchor) {
    ring_.put_anchor(place->sample, clock.time_ns, clock.interval_ns);
    clock_anchor_ = place->sample;
  }
  if (!clock.fault.empty()) faults_.note(Fault::clock, std::move(clock.fault));
  deviation_ns_ = clock.deviation_ns;
  if (place->time_ns) told_ = {place->sample, *place->time_ns};
  again_ = 0;
  put_values(arrival, *place);
  check_rate(*place, place->sample + left);
  SourcePosition reached = position.told() ? position : ring_.source();
  if (position.told() && !arrival.ends.empty()) reached.word[3] = arrival.ends.back();
  ring_.commit(reached, place->offset);
  if (far_ && !sure) count(counters_.lost, far_->samples);  // one wrong index
  if (far_) forget_far();
  return Outcome::taken;
}

/// Takes the message that was refused, now that it is confirmed; keeps it where there is no room.
Intake::Outcome Intake::take_far() {
  Far far = *std::exchange(far_, std::nullopt);
  std::vector<std::string_view> columns;
  const Outcome outcome = take(far.message.arrival(columns), far.position, true);
  if (outcome == Outcome::full)
    far_ = std::move(far);
  else
    forget_far();
  return outcome;
}

/// Whether samples from this one on, as the sender counts, confirm the message that was refused.
bool Intake::goes_on_from_far(std::uint64_t first) const {
  return first >= far_->first &&
         static_cast<double>(first - far_->first) <=
             kSuddenGap_s * ring_.settings().sample_rate_hz + static_cast<double>(far_->samples);
}

/// Refuses a message until another confirms it. Its source may not send it again, not even after a kill:
/// brokers are told that it came.
void Intake::keep_far(const Arrival& arrival, const SourcePosition& position, std::uint64_t before) {
  const std::uint64_t first = arrival.first_sample.value_or(0) + before;
  const std::uint64_t due = ring_.next_sample() - ring_.sender_offset();
  if (far_) count(counters_.lost, far_->samples);  // two wrong ones do not confirm each other
  far_ = Far{ArrivalCopy(arrival), position, first, arrival.samples() - before};
  write_far();
  faults_.note(Fault::order,
               fmt::format("sample {} comes where {} is due, {:.0f} s of samples before it, in less time; it "
                           "is left out until a next message goes on from it, which is required",
                           first, due, static_cast<double>(first - due) / ring_.settings().sample_rate_hz));
}

/// Beside the ring, as lasting as its samples; where the disk is full, as lasting as the process.
void Intake::write_far() const {
  ByteWriter to;
  to.put(kFarFormat);
  to.put(ring_.next_sample());
  to.put(ring_.sender_offset());
  to.put(far_->position);
  to.put(far_->first);
  to.put(far_->samples);
  far_->message.write(to);
  const std::string_view bytes(reinterpret_cast<const char*>(to.bytes().data()), to.bytes().size());
  ByteWriter sum;
  sum.put(crc32c(bytes));
  std::ofstream file(far_file_, std::ios::binary);
  file.write(reinterpret_cast<const char*>(sum.bytes().data()), std::ssize(sum.bytes()));
  file.write(bytes.data(), std::ssize(bytes));
}

/// What a former process refused, unless the ring went on since.
void Intake::read_far() {
  std::ifstream file(far_file_, std::ios::binary);
  if (!file) return;
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  ByteReader from(std::as_bytes(std::span(text)));
  std::uint32_t sum = 0, format = 0;
  std::uint64_t next_sample = 0, sender_offset = 0, first = 0, samples = 0;
  SourcePosition position;
  from.get(sum);
  from.get(format);
  if (!from.ok() || sum != crc32c(std::string_view(text).substr(sizeof sum)) || format != kFarFormat)
    return forget_far();
  from.get(next_sample);
  from.get(sender_offset);
  from.get(position);
  from.get(first);
  from.get(samples);
  ArrivalCopy message(from);
  if (from.ok() && next_sample == ring_.next_sample() && sender_offset == ring_.sender_offset())
    far_ = Far{std::move(message), position, first, samples};
  else
    forget_far();
}

void Intake::forget_far() {
  far_.reset();
  std::error_code ignored;
  std::filesystem::remove(far_file_, ignored);
}

/// Samples at the beginning of a message that the ring has, by the position of the source.
std::uint64_t Intake::come_before(const Arrival& arrival, const SourcePosition& position) const {
  if (!position.told() || !ring_.source().told()) return 0;
  if (arrival.ends.size() != arrival.samples())
    return position.at_or_before(ring_.source()) ? arrival.samples() : 0;
  SourcePosition place = position;
  const auto first = std::partition_point(arrival.ends.begin(), arrival.ends.end(), [&](std::uint64_t end) {
    place.word[3] = end;
    return place.at_or_before(ring_.source());
  });
  return static_cast<std::uint64_t>(first - arrival.ends.begin());
}

/// Checks what does not depend on the order; counts what is wrong.
bool Intake::usable(const Arrival& arrival, std::uint64_t left) {
  const double rate = ring_.settings().sample_rate_hz;
  const auto refused = [&](Fault kind, std::string text) {
    faults_.note(kind, std::move(text));
    count(counters_.lost, left);
    return false;
  };
  if (arrival.columns.empty() || arrival.values.size() % arrival.columns.size() != 0)
    return refused(Fault::format, fmt::format("{} values in {} columns; whole samples are required",
                                              arrival.values.size(), arrival.columns.size()));
  if (!map_columns(arrival)) {
    count(counters_.lost, left);
    return false;
  }
  if (arrival.sample_rate_hz != 0.0 && !(std::abs(arrival.sample_rate_hz / rate - 1.0) <= kRateTolerance))
    return refused(Fault::rate, fmt::format("the sender tells {} Hz; {} Hz are required, which the axis has",
                                            arrival.sample_rate_hz, rate));
  if (left > ring_.most_samples())
    return refused(Fault::size,
                   fmt::format("a message of {} samples; at most {} are required, a quarter of the ring",
                               left, ring_.most_samples()));
  return true;
}

/// Finds the columns of the channels, where they are not those of the last message.
bool Intake::map_columns(const Arrival& arrival) {
  if (mapped_ && std::equal(columns_.begin(), columns_.end(), arrival.columns.begin(), arrival.columns.end()))
    return true;
  columns_.assign(arrival.columns.begin(), arrival.columns.end());
  mapped_ = false;
  for (std::size_t c = 0; c < ring_.channels(); ++c) {
    const auto found = std::find(columns_.begin(), columns_.end(), names_[c]);
    if (found == columns_.end()) {
      std::string there;
      for (const auto& column : columns_) there += (there.empty() ? "" : ", ") + column;
      faults_.note(Fault::columns, fmt::format("there is no column '{}', which is required, but {}",
                                               names_[c], printable(there)));
      return false;
    }
    if (std::find(found + 1, columns_.end(), names_[c]) != columns_.end()) {
      faults_.note(Fault::columns,
                   fmt::format("several columns have the name '{}': which one is meant cannot "
                               "be known",
                               names_[c]));
      return false;
    }
    from_[c] = static_cast<std::size_t>(found - columns_.begin());
  }
  mapped_ = true;
  return true;
}

/// Which samples are put where; nothing where they cannot be counted, which is said.
std::optional<Intake::Place> Intake::place_of(const Arrival& arrival, std::uint64_t skipped) {
  const double interval_ns = kSecond_ns / ring_.settings().sample_rate_hz;
  const std::uint64_t next = ring_.next_sample();
  Place place{next, skipped, ring_.sender_offset(), false, {}};
  const auto told_at = [&](std::uint64_t k) {
    return later(*arrival.time_ns, interval_ns * static_cast<double>(k));
  };
  if (arrival.time_ns && (*arrival.time_ns < 0 || *arrival.time_ns > kLatestTime))
    faults_.note(Fault::clock,
                 fmt::format("a time of {} ns; UNIX time from 1970 to 2116 is required", *arrival.time_ns));
  else if (arrival.time_ns)
    place.time_ns = told_at(skipped);
  if (!arrival.first_sample) return place;

  const std::uint64_t first = *arrival.first_sample;
  if (first > kMostIndex || first + place.offset > kMostIndex) {
    faults_.note(Fault::order, fmt::format("sample {} is beyond counting; at most 2^62 is required", first));
    return std::nullopt;
  }
  place.sample = first + skipped + place.offset;
  const std::uint64_t samples = arrival.samples() - skipped;
  if (place.sample >= next) return place;
  if (restarts(place, samples)) {
    // More than a second, so that nobody takes the samples before and after it for consecutive ones.
    const auto second = static_cast<std::uint64_t>(ring_.settings().sample_rate_hz) + 1;
    const auto clock = ring_.next_time_ns();
    double ahead_ns = place.time_ns && clock ? static_cast<double>(*place.time_ns - *clock) : 0.0;
    if (ahead_ns > kJump_ns && off_host_ns(*place.time_ns) > kHostTolerance_ns) ahead_ns = 0.0;
    const std::uint64_t gap =
        std::max(second, static_cast<std::uint64_t>(std::max(0.0, ahead_ns / interval_ns)));
    faults_.note(Fault::restart,
                 fmt::format("the sender counts from {} again, where {} was due; its samples go on from {}",
                             first, next - place.offset, next + gap));
    if (next + gap > kMostIndex) return std::nullopt;
    place.sample = next + gap;
    place.offset = place.sample - first - skipped;
    place.restarted = true;
    return place;
  }
  const std::uint64_t there = std::min(samples, next - place.sample);
  place.skipped += there;
  place.sample += there;
  if (place.time_ns) place.time_ns = told_at(place.skipped);
  return place;
}

/// Whether a gap can be: the time that the sender tells, else this machine's clock, went on as far since the
/// newest sample. One wrong index would have all that come after it late.
bool Intake::likely(const Place& place) const {
  if (place.sample <= ring_.next_sample()) return true;
  const double gap_s =
      static_cast<double>(place.sample - ring_.next_sample()) / ring_.settings().sample_rate_hz;
  if (place.restarted || ring_.end() == 0 || gap_s <= kSuddenGap_s) return true;
  const auto clock = ring_.next_time_ns();
  double passed_s = 0.0;
  if (place.time_ns && clock)
    passed_s = static_cast<double>(*place.time_ns - *clock) / kSecond_ns;
  else if (arrived_ns_ == 0)  // how long nobody was here, nobody knows
    return true;
  else
    passed_s = static_cast<double>(host_now_ns() - arrived_ns_) / kSecond_ns;
  return gap_s <= kSuddenGap_s + kGapPerTime * std::max(0.0, passed_s);
}

/// Whether samples with indices that were due before are new ones of a sender that counts from the beginning
/// again: their time is not that of the samples with these indices. Without times: they are too many to
/// be a repetition. What a source gives again after a kill is known by its position, and does not come here.
bool Intake::restarts(const Place& place, std::uint64_t samples) {
  const std::uint64_t next = ring_.next_sample();
  const auto own = time_of(place.sample);
  if (place.time_ns && own) {
    const auto wrong = static_cast<double>(*place.time_ns - *own);
    const double behind = static_cast<double>(next - place.sample) * ring_.interval_ns();
    const bool of_now = static_cast<double>(*place.time_ns - *ring_.next_time_ns()) > -kClockTolerance_ns;
    return (of_now && behind > 2.0 * kClockTolerance_ns) ||
           (std::abs(wrong) > kSecond_ns && std::abs(wrong - deviation_ns_) > kSecond_ns);
  }
  if (place.sample + samples > next) return false;
  again_ = place.sample == again_next_ ? again_ + samples : samples;
  again_next_ = place.sample + samples;
  return static_cast<double>(again_) > kRepetition_s * ring_.settings().sample_rate_hz;
}

/// Counts samples that come after their turn: late where nothing had come in their place, else duplicate.
void Intake::leave_out(std::uint64_t from, std::uint64_t to) {
  std::uint64_t late = 0;
  for (const auto& [first, last] : gaps_)
    late += std::min(last, to) - std::min({std::max(first, from), last, to});
  count(counters_.duplicate, to - from - late);
  if (late == 0) return;
  count(counters_.late, late);
  faults_.note(Fault::order,
               fmt::format("samples {} ... {} come after sample {}; ascending order is required", from,
                           to - 1, ring_.next_sample() - 1));
}

/// Time of a sample that was put, or would have been; by the newest anchor where it is overwritten.
std::optional<std::int64_t> Intake::time_of(std::uint64_t sample) const {
  const auto next = ring_.next_time_ns();
  if (!next) return std::nullopt;
  const Piece piece = ring_.piece(ring_.position_of(sample), 1);
  if (piece.samples > 0 && piece.first_sample == sample && piece.time_ns) return piece.time_ns;
  const double before = ring_.interval_ns() * static_cast<double>(ring_.next_sample() - sample);
  return *next - std::llround(std::min(before, static_cast<double>(kLatestTime)));
}

/// A small change counts at once, as does a time of now: a sender that has paused. Any other has to be
/// confirmed, or one wrong time would spoil all that come after it.
Intake::Trust Intake::trust_in(const Place& place, std::uint64_t gap) {
  const auto before = ring_.next_time_ns();
  if (!before || !place.time_ns) return Trust::believed;
  const double nominal_ns = kSecond_ns / ring_.settings().sample_rate_hz;
  const double gap_ns = nominal_ns * static_cast<double>(gap);
  const std::int64_t told = *place.time_ns, here = later(*before, gap_ns);
  const auto deviation = static_cast<double>(told - here);
  if (std::abs(deviation) <= kJump_ns + kRateTolerance * gap_ns) {
    claim_.reset();
    return Trust::believed;
  }
  if (deviation > 0.0 && off_host_ns(told) < kHostTolerance_ns) return Trust::believed;
  if (!confirmed(place.sample, told)) return Trust::doubted;
  if (deviation > -kLongestSlew_ns) return Trust::believed;
  // A sender that has lost its clock tells of years ago.
  const bool likely = deviation > -kDay_ns || off_host_ns(told) < off_host_ns(here);
  return likely && place.sample < kMostIndex ? Trust::anew : Trust::doubted;
}

/// Whether the times that are told go as their samples do, for long enough.
bool Intake::confirmed(std::uint64_t sample, std::int64_t told_ns) {
  if (claim_ && sample >= claim_->sample) {
    const double since_ns =
        kSecond_ns / ring_.settings().sample_rate_hz * static_cast<double>(sample - claim_->sample);
    if (std::abs(static_cast<double>(told_ns - claim_->time_ns) - since_ns) <=
        kClaimTolerance_ns + 0.1 * since_ns)
      return since_ns >= kClaim_ns;
  }
  claim_ = {sample, told_ns};
  return false;
}

/// Puts a gap before the samples, more than a second: what comes after it has nothing to do with what was
/// before, and its time may be an earlier one.
void Intake::begin_anew(Place& place) {
  const auto gap = static_cast<std::uint64_t>(ring_.settings().sample_rate_hz) + 1;
  faults_.note(Fault::clock,
               fmt::format("the clock was ahead of the sender's by {:.0f} s and begins anew, after a gap, at "
                           "sample {}",
                           static_cast<double>(*ring_.next_time_ns() - *place.time_ns) / kSecond_ns,
                           place.sample + gap));
  place.sample += gap;
  place.offset += gap;
  place.restarted = true;
  claim_.reset();
}

/// What a message tells of the sender's clock. The ring's goes by the rate of the axis. Where it is behind,
/// it is put forward; where it is ahead it goes slower for a while, since time does not turn back among
/// samples that follow one another.
Intake::Clock Intake::clock_at(const Place& place, std::uint64_t gap, bool jump, Trust trust) const {
  const double nominal_ns = kSecond_ns / ring_.settings().sample_rate_hz;
  const auto before = ring_.next_time_ns();
  if (!before) return {jump || place.time_ns, place.time_ns, {}};
  const std::int64_t here = later(*before, ring_.interval_ns() * static_cast<double>(gap));
  if (!place.time_ns) return {jump, jump ? std::optional(here) : std::nullopt, {}, {}, deviation_ns_};
  const std::int64_t told = *place.time_ns;
  const auto deviation = static_cast<double>(told - here);
  Clock clock{false, {}, {}, {}, deviation};
  const double allowed = kClockTolerance_ns + kRateTolerance * nominal_ns * static_cast<double>(gap);
  if (std::abs(deviation - deviation_ns_) > allowed && (!place.restarted || trust == Trust::doubted)) {
    const double rate = told_ && place.sample > told_->first && told > told_->second
                            ? kSecond_ns * static_cast<double>(place.sample - told_->first) /
                                  static_cast<double>(told - told_->second)
                            : 0.0;
    clock.fault = fmt::format(
        "the sender's time leaves its samples by {:.3f} s at sample {}; less than 0.1 s is required",
        deviation / kSecond_ns, place.sample);
    if (rate > 0.0)
      clock.fault += fmt::format(" (since the last message its times tell {:.6g} Hz, the axis has {:.6g} Hz)",
                                 rate, ring_.settings().sample_rate_hz);
  }
  if (jump) {
    clock.anchor = true;
    clock.time_ns = trust == Trust::anew ? told : trust == Trust::doubted ? here : std::max(told, *before);
    clock.deviation_ns = static_cast<double>(told - *clock.time_ns);
    return clock;
  }
  if (trust == Trust::doubted) return clock;
  const bool slewing = ring_.interval_ns() != nominal_ns;
  const double since_ns =
      nominal_ns * static_cast<double>(place.sample - std::min(clock_anchor_, place.sample));
  if (since_ns < kSecond_ns) return clock;  // a clock that wavers does not fill the ring's anchors
  if (deviation > kClockTolerance_ns) {
    clock.anchor = true;
    clock.time_ns = told;
    clock.deviation_ns = 0.0;
  } else if (deviation < -kClockTolerance_ns && (!slewing || since_ns > kSlewTime_ns)) {
    clock.anchor = true;
    clock.time_ns = here;
    clock.interval_ns = nominal_ns * std::max(0.5, 1.0 + deviation / kSlewTime_ns);
  } else if (slewing && deviation > -kSlewed_ns) {
    clock.anchor = true;
    clock.time_ns = here;
  }
  return clock;
}

/// By the sender's times, which belong to the first sample; else by when the last one came.
void Intake::check_rate(const Place& place, std::uint64_t end) {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  if (place.restarted) told_rate_.reset();
  const auto found = place.time_ns ? told_rate_.step(place.sample, 1e-9 * static_cast<double>(*place.time_ns))
                                   : arrival_rate_.step(end, std::chrono::duration<double>(now).count());
  if (!found) return;
  const double rate = ring_.settings().sample_rate_hz;
  faults_.note(Fault::rate,
               fmt::format("sample_rate_hz: {} {:.6g} Hz for a minute, {:+.2g} % off the {:.6g} Hz that were "
                           "told",
                           place.time_ns ? "the sender's times tell" : "samples come at", *found,
                           100.0 * (*found / rate - 1.0), rate));
}

/// Puts the channels of the samples that are new.
void Intake::put_values(const Arrival& arrival, const Place& place) {
  const std::size_t width = arrival.columns.size(), channels = ring_.channels();
  const std::size_t samples = arrival.samples() - place.skipped;
  values_.resize(samples * channels);
  const double* row = arrival.values.data() + place.skipped * width;
  double* to = values_.data();
  std::uint64_t missing = 0;
  for (std::size_t k = 0; k < samples; ++k, row += width) {
    bool finite = true;
    for (std::size_t c = 0; c < channels; ++c) {
      const double value = row[from_[c]];
      finite = finite && std::isfinite(value);
      *to++ = std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
    }
    missing += finite ? 0U : 1U;
    if (!finite && !not_finite_)
      faults_.note(
          Fault::value,
          fmt::format("sample {} has a value that is no finite number, which is required", place.sample + k));
    not_finite_ = !finite;
  }
  ring_.put(values_);
  count(counters_.samples, samples);
  count(counters_.missing, missing);
}

}  // namespace resonid::monitor
