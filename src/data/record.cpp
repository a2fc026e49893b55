// SPDX-License-Identifier: MIT
#include <cassert>
#include <resonid/data/record.hpp>

namespace resonid::data {

const std::vector<double>& exciting(const Record& record) {
  return record.excitation.present() ? record.excitation.samples : record.input.samples;
}

Record part_of(const Record& record, std::size_t first, std::size_t count) {
  assert(first + count <= record.samples());
  Record part;  // member by member: a long record is not copied for a short part of it
  part.source = record.source;
  part.sample_rate_hz = record.sample_rate_hz;
  part.start_time_s = record.start_time_s + static_cast<double>(first) * record.sample_time_s();
  part.second_output_kind = record.second_output_kind;
  part.output_quantity = record.output_quantity;
  part.motion = record.motion;
  part.reading = record.reading;
  part.sampling = record.sampling;
  part.sampling.filled.clear();
  for (const std::size_t place : record.sampling.filled)
    if (place >= first && place < first + count) part.sampling.filled.push_back(place - first);
  for (const auto channel : {&Record::input, &Record::output, &Record::excitation, &Record::reference,
                             &Record::position, &Record::second_output}) {
    const Channel& all = record.*channel;
    Channel& few = part.*channel;
    few.name = all.name;
    few.unit = all.unit;
    few.unit_assumed = all.unit_assumed;
    if (!all.present()) continue;
    const auto begin = all.samples.begin() + static_cast<std::ptrdiff_t>(first);
    few.samples.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
  }
  return part;
}

}  // namespace resonid::data
