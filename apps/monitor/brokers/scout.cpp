// SPDX-License-Identifier: MIT
#include "monitor/brokers/scout.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace resonid::monitor {
namespace {

constexpr std::size_t kMostSeen = 10'000;
constexpr std::size_t kMostKeptSamples = 8'192;  // of one axis
constexpr std::size_t kMostKeptValues = 4'000'000;
constexpr std::size_t kHead = 4'096;       // bytes that tell the format of a stream
constexpr std::size_t kLongHead = 65'536;  // of one without an end of line

/// Most particular first: everything that is text may be CSV.
constexpr SampleFormat kGuesses[] = {SampleFormat::frame, SampleFormat::json, SampleFormat::line_protocol,
                                     SampleFormat::csv};

bool may_be(SampleFormat format, std::string_view payload) {
  switch (format) {
    case SampleFormat::frame:
      return payload.starts_with("RSN");
    case SampleFormat::json:
      return !payload.empty() && (payload.front() == '{' || payload.front() == '[');
    case SampleFormat::line_protocol:
      return payload.find('=') != std::string_view::npos;
    case SampleFormat::csv:
      break;
  }
  return true;
}

/// Names for the numbers of lines that have none.
std::vector<std::string> numbered_columns(std::string_view payload) {
  while (payload.starts_with('#'))
    payload.remove_prefix(std::min(payload.find('\n'), payload.size() - 1) + 1);
  const std::string_view line = payload.substr(0, payload.find('\n'));
  const bool blanks = line.find_first_of(",;\t") == std::string_view::npos;
  const auto separators = std::count_if(line.begin(), line.end(), [&](char c) {
    return blanks ? c == ' ' : c == ',' || c == ';' || c == '\t';
  });
  std::vector<std::string> names;
  for (std::ptrdiff_t k = 0; k <= separators; ++k) names.push_back(fmt::format("column {}", k + 1));
  return names;
}

bool has_samples(const Arrival& arrival) {
  return arrival.samples() > 0 && !std::all_of(arrival.values.begin(), arrival.values.end(),
                                               [](double value) { return std::isnan(value); });
}

using TakeGuessed = std::function<void(const Format&, const Arrival&)>;

/// Reads a message in the first format that gives samples; nothing where none does.
std::optional<Format> read_unknown(std::string_view payload, const TakeGuessed& take) {
  const auto reads = [&](const Format& guess) {
    bool any = false;
    FaultLog faults;
    Decoder(guess, faults).message(payload, [&](const Message& message) {
      const auto* arrival = std::get_if<Arrival>(&message);
      if (arrival == nullptr || !has_samples(*arrival)) return;
      take(guess, *arrival);
      any = true;
    });
    return any;
  };
  for (const SampleFormat format : kGuesses)
    if (Format guess{format}; may_be(format, payload) && reads(guess)) return guess;
  if (Format guess{SampleFormat::csv, numbered_columns(payload)}; reads(guess)) return guess;
  return std::nullopt;
}

}  // namespace

Scout::Seen* Scout::seen(Key key) {
  const auto known = seen_.find(key);
  if (known != seen_.end()) return &known->second;
  if (seen_.size() >= kMostSeen) return nullptr;
  Seen& seen = seen_[key];
  seen.what.stream = std::move(key.stream);
  seen.what.name = std::move(key.name);
  seen.what.axis = std::move(key.axis);
  return &seen;
}

void Scout::add(std::string_view name, std::string_view stream, std::string_view payload, double time_s) {
  const auto guess = read_unknown(payload, [&](const Format& format, const Arrival& arrival) {
    note(name, stream, format, arrival, time_s);
  });
  if (guess) return;
  if (Seen* const s = seen({std::string(stream), std::string(name), {}})) ++s->what.messages;
}

void Scout::note(std::string_view name, std::string_view stream, const Format& guess, const Arrival& arrival,
                 double time_s) {
  if (!has_samples(arrival)) return;
  Seen* const place = seen({std::string(stream), std::string(name), std::string(arrival.axis)});
  if (place == nullptr) return;
  Seen& s = *place;
  ++s.what.messages;
  s.what.format = guess.kind;
  s.what.named = guess.columns.empty();
  s.what.told_rate_hz = arrival.sample_rate_hz;
  s.what.numbered = arrival.first_sample.has_value();
  s.what.timed = arrival.time_ns.has_value();
  // What is sent again, since nobody acknowledges it.
  const std::uint64_t next = arrival.first_sample.value_or(0) + arrival.samples();
  if (arrival.first_sample && next <= s.next_sample) return;
  if (arrival.first_sample) s.next_sample = next;
  if (s.what.sample_count == 0)
    s.first_s = time_s;
  else if (time_s > s.first_s)
    s.samples_after_first += arrival.samples();
  s.last_s = time_s;
  if (arrival.time_ns) {
    if (!s.first_ns) s.first_ns = arrival.time_ns;
    s.last_ns = arrival.time_ns;
    s.timed_before_last = s.timed;
    s.timed += arrival.samples();
  }
  s.what.sample_count += arrival.samples();
  keep(s, arrival);
}

void Scout::keep(Seen& seen, const Arrival& arrival) {
  auto& what = seen.what;
  const std::size_t columns = arrival.columns.size();
  if (!std::equal(what.columns.begin(), what.columns.end(), arrival.columns.begin(), arrival.columns.end())) {
    what.columns.assign(arrival.columns.begin(), arrival.columns.end());
    what.samples.assign(columns, {});
  }
  for (std::size_t k = 0; k < arrival.samples(); ++k) {
    if (what.samples.front().size() >= kMostKeptSamples || kept_values_ + columns > kMostKeptValues) return;
    for (std::size_t c = 0; c < columns; ++c) what.samples[c].push_back(arrival.values[k * columns + c]);
    kept_values_ += columns;
  }
}

std::vector<Discovered> Scout::found() const {
  std::vector<Discovered> all;
  for (const auto& [key, seen] : seen_) {
    Discovered& what = all.emplace_back(seen.what);
    if (seen.last_s > seen.first_s)
      what.measured_rate_hz = static_cast<double>(seen.samples_after_first) / (seen.last_s - seen.first_s);
    if (seen.first_ns && *seen.last_ns > *seen.first_ns)
      what.timed_rate_hz = 1e9 * static_cast<double>(seen.timed_before_last) /
                           static_cast<double>(*seen.last_ns - *seen.first_ns);
  }
  return all;
}

Decoder::Take ByteScout::noting(double time_s) {
  return [this, time_s](const Message& message) {
    const auto* arrival = std::get_if<Arrival>(&message);
    if (arrival != nullptr) scout_.note({}, {}, guess_, *arrival, time_s);
    if (!on_frame_ || guess_.kind != SampleFormat::frame) return;
    if (arrival != nullptr)
      on_frame_(arrival->axis);
    else if (const auto* question = std::get_if<Question>(&message))
      on_frame_(question->axis);
  };
}

void ByteScout::add(std::string_view bytes, double time_s) {
  if (decoder_) return decoder_->add(bytes, noting(time_s));
  head_ += bytes;
  const bool enough = head_.size() >= kHead && head_.find('\n') != std::string::npos;
  if (head_.starts_with("RSN") || enough || head_.size() >= kLongHead) decide(time_s);
}

/// Lines that are whole decide; without any, all that there is.
void ByteScout::decide(double time_s) {
  const std::size_t end = head_.rfind('\n');
  const std::string_view whole = std::string_view(head_).substr(0, end == std::string::npos ? end : end + 1);
  if (head_.starts_with("RSN"))  // a question may come first
    guess_.kind = SampleFormat::frame;
  else if (auto guess = read_unknown(whole, [](const Format&, const Arrival&) {}))
    guess_ = std::move(*guess);  // else words; numbers may come
  decoder_.emplace(guess_, faults_);
  decoder_->add(head_, noting(time_s));
  head_.clear();
}

void ByteScout::finish(double time_s) {
  if (!decoder_) decide(time_s);
  decoder_->finish(noting(time_s));
}

}  // namespace resonid::monitor
