// SPDX-License-Identifier: MIT
#include <algorithm>
#include <identification/identify/select/stretches.hpp>

namespace resonid::identification::detail {
namespace {

data::Record stretch(const data::Record& record, std::size_t from, std::size_t length) {
  data::Record part;
  part.source = record.source;
  part.sample_rate_hz = record.sample_rate_hz;
  part.start_time_s = record.start_time_s + static_cast<double>(from) / record.sample_rate_hz;
  part.second_output_kind = record.second_output_kind;
  part.output_quantity = record.output_quantity;
  part.motion = record.motion;
  part.sampling = record.sampling;
  using Channel = data::Channel data::Record::*;
  for (const Channel channel :
       {&data::Record::input, &data::Record::output, &data::Record::excitation, &data::Record::reference,
        &data::Record::position, &data::Record::second_output}) {
    const auto& all = record.*channel;
    auto& few = part.*channel;
    few.name = all.name;
    few.unit = all.unit;
    if (!all.present()) continue;
    const auto begin = all.samples.begin() + static_cast<std::ptrdiff_t>(from);
    few.samples.assign(begin, begin + static_cast<std::ptrdiff_t>(length));
  }
  return part;
}

}  // namespace

std::vector<data::Record> stretches_of(const data::Record& record, double low_hz, bool sweeps) {
  constexpr std::size_t kAll = 65'536, kFew = 8, kMany = 32;
  std::size_t count = kFew;
  if (sweeps) {
    const double two_periods = 2.0 * record.sample_rate_hz / std::max(low_hz, 1e-9);
    count = static_cast<std::size_t>(std::clamp(static_cast<double>(kAll) / two_periods,
                                                static_cast<double>(kFew), static_cast<double>(kMany)));
  }
  const std::size_t every = record.samples() / count;
  std::vector<data::Record> parts;
  for (std::size_t i = 0; i < count; ++i)
    parts.push_back(stretch(record, i * every, std::min(kAll / count, every)));
  return parts;
}

}  // namespace resonid::identification::detail
