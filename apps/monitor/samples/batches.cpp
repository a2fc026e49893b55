// SPDX-License-Identifier: MIT
#include "monitor/samples/batches.hpp"

#include <algorithm>

namespace resonid::monitor {
namespace {

constexpr std::size_t kMostValues = 16'384;
constexpr std::size_t kMostSamples = 256;  // a small ring takes no more at once
constexpr std::size_t kMostNameBytes = 1'000'000;
constexpr std::size_t kMostAxes = 256;         // all are taken, and forgotten, when there are more
constexpr std::size_t kMostKeptValues = 8192;  // whose memory is kept for the next ones
constexpr std::int64_t kLongestStep_ns =
    100'000'000;  // a longer one may be a jump: the first sample tells of it

}  // namespace

bool Batches::continues(const Batch& batch, const Arrival& line) {
  const Arrival& before = batch.arrival;
  const std::uint64_t count = batch.ends.size();
  if (before.first_sample.has_value() != line.first_sample.has_value() ||
      (line.first_sample && *line.first_sample - *before.first_sample != count))
    return false;
  if (line.time_ns && (!batch.last_time_ns || *line.time_ns < *batch.last_time_ns ||
                       *line.time_ns - *batch.last_time_ns > kLongestStep_ns))
    return false;
  return before.sample_rate_hz == line.sample_rate_hz && batch.values.size() < kMostValues &&
         count < kMostSamples &&
         std::equal(batch.columns.begin(), batch.columns.end(), line.columns.begin(), line.columns.end());
}

void Batches::add(const Arrival& line, const Take& take) {
  auto found = batches_.find(line.axis);
  if (found == batches_.end()) {
    if (batches_.size() >= kMostAxes) {
      flush(take);
      batches_.clear();
    }
    found = batches_.emplace(line.axis, Batch{}).first;
    name_bytes_ += line.axis.size();
  }
  Batch& batch = found->second;
  if (!batch.ends.empty() && !continues(batch, line)) flush(found->first, batch, take);
  if (batch.ends.empty()) {
    batch.arrival.first_sample = line.first_sample;
    batch.arrival.time_ns = line.time_ns;
    batch.arrival.sample_rate_hz = line.sample_rate_hz;
    if (!std::equal(batch.columns.begin(), batch.columns.end(), line.columns.begin(), line.columns.end())) {
      batch.columns.assign(line.columns.begin(), line.columns.end());
      for (const std::string& name : batch.columns) name_bytes_ += name.size();
    }
  }
  batch.last_time_ns = line.time_ns ? line.time_ns : batch.last_time_ns;
  batch.values.insert(batch.values.end(), line.values.begin(), line.values.end());
  batch.ends.insert(batch.ends.end(), line.ends.begin(), line.ends.end());
}

void Batches::end_line(std::uint64_t begin, std::uint64_t end) {
  for (auto& [axis, batch] : batches_)
    if (!batch.ends.empty() && batch.ends.back() > begin) batch.ends.back() = end;
}

void Batches::flush(const Take& take) {
  for (auto& [axis, batch] : batches_)
    if (!batch.ends.empty()) flush(axis, batch, take);
  if (name_bytes_ <= kMostNameBytes) return;
  batches_.clear();
  name_bytes_ = 0;
}

void Batches::flush(std::string_view axis, Batch& batch, const Take& take) {
  Arrival arrival = batch.arrival;
  names_.assign(batch.columns.begin(), batch.columns.end());
  arrival.axis = axis;
  arrival.columns = names_;
  arrival.values = batch.values;
  arrival.ends = batch.ends;
  take(arrival);
  if (batch.values.capacity() > kMostKeptValues) batch.values = {};
  batch.values.clear();
  if (batch.ends.capacity() > kMostKeptValues) batch.ends = {};
  batch.ends.clear();
  batch.last_time_ns.reset();
}

}  // namespace resonid::monitor
