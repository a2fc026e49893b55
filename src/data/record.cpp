// SPDX-License-Identifier: MIT
#include <cassert>
#include <resonid/data/record.hpp>

namespace resonid::data {

const std::vector<double>& exciting(const Record& record) {
  return record.excitation.present() ? record.excitation.samples : record.input.samples;
}

Record part_of(const Record& record, std::size_t first, std::size_t count) {
  assert(first + count <= record.samples());
  Record part = record;
  for (auto* channel :
       {&part.input, &part.output, &part.excitation, &part.reference, &part.position, &part.second_output})
    if (channel->present()) {
      const auto begin = channel->samples.begin() + static_cast<std::ptrdiff_t>(first);
      channel->samples = std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(count));
    }
  part.start_time_s += static_cast<double>(first) * record.sample_time_s();
  return part;
}

}  // namespace resonid::data
