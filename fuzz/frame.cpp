// SPDX-License-Identifier: MIT
// Samples as sources get them: the first byte chooses the binary frame or a text format, the second the size
// of the pieces in which the rest arrives.
#include "monitor/samples/frame.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "input_file.hpp"
#include "monitor/samples/text_decoder.hpp"

namespace {

using namespace resonid;
using namespace resonid::monitor;

void check(const Arrival& arrival) {
  fuzz::require(!arrival.columns.empty() && arrival.columns.size() <= kMostColumns);
  fuzz::require(arrival.values.size() % arrival.columns.size() == 0);
  for (const auto column : arrival.columns) fuzz::require(column.size() <= kLongestLine);
}

void check_message(const Message& message) {
  const auto* arrival = std::get_if<Arrival>(&message);
  if (arrival == nullptr) return;
  check(*arrival);
  fuzz::require(arrival->sample_rate_hz >= 0.0 && std::isfinite(arrival->sample_rate_hz));
  fuzz::require(encoded(*arrival, ValueType::float32).has_value());
}

/// The places in the stream ascend, and none lies behind what came.
void read_text(Format settings, std::string_view text, std::size_t piece) {
  FaultLog faults;
  TextDecoder decoder(std::move(settings), faults);
  std::size_t come = 0;
  const auto take = [&](const Arrival& arrival) {
    check(arrival);
    fuzz::require(!arrival.ends.empty() && arrival.ends.size() == arrival.samples());
    for (std::size_t k = 1; k < arrival.ends.size(); ++k)
      fuzz::require(arrival.ends[k - 1] < arrival.ends[k]);
    fuzz::require(arrival.ends.back() <= come);
  };
  for (std::size_t at = 0; at < text.size(); at += piece) {
    come = std::min(at + piece, text.size());
    decoder.add(text.substr(at, piece), take);
  }
  decoder.finish(take);
  come = text.size();
  decoder.message(text, take);
  fuzz::require(printable(faults.example(Fault::format), 200).size() <= 200);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 2, size - 2);
  const std::size_t piece = data[1] == 0 ? 65'536 : data[1];
  switch (data[0] % 5) {
    case 0:
      read_text({SampleFormat::csv, {}, {}}, bytes, piece);
      break;
    case 1:
      read_text({SampleFormat::csv, {"ru", "u", "y"}, "x"}, bytes, piece);
      break;
    case 2:
      read_text({SampleFormat::json, {}, {}}, bytes, piece);
      break;
    case 3:
      read_text({SampleFormat::line_protocol, {}, {}}, bytes, piece);
      break;
    default: {
      FaultLog faults;
      FrameDecoder decoder(faults);
      for (std::size_t at = 0; at < bytes.size(); at += piece)
        decoder.add(bytes.substr(at, piece), check_message);
      decoder.finish();
      fuzz::require(decoder.skipped_bytes() <= bytes.size());
      fuzz::require((decoder.skipped_bytes() > 0) == (faults.total() > 0));
    }
  }
  return 0;
}
