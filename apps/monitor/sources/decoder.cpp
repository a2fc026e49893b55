// SPDX-License-Identifier: MIT
#include "monitor/sources/decoder.hpp"

namespace resonid::monitor {
namespace {

std::variant<FrameDecoder, TextDecoder> decoder_of(const Format& format, FaultLog& faults) {
  if (format.kind == SampleFormat::frame) return FrameDecoder(faults);
  return TextDecoder(format, faults);
}

TextDecoder::Take taking_arrivals(const Decoder::Take& take) {
  return [&take](const Arrival& arrival) { take(arrival); };
}

}  // namespace

Decoder::Decoder(const Format& format, FaultLog& faults)
    : decoder_(decoder_of(format, faults)), faults_(faults) {}

void Decoder::add(std::string_view bytes, const Take& take) {
  if (auto* text = std::get_if<TextDecoder>(&decoder_)) return text->add(bytes, taking_arrivals(take));
  std::get<FrameDecoder>(decoder_).add(bytes, take);
}

void Decoder::finish(const Take& take) {
  if (auto* text = std::get_if<TextDecoder>(&decoder_)) return text->finish(taking_arrivals(take));
  std::get<FrameDecoder>(decoder_).finish();
}

void Decoder::break_off() {
  if (auto* text = std::get_if<TextDecoder>(&decoder_)) return text->break_off();
  std::get<FrameDecoder>(decoder_).finish();
}

void Decoder::message(std::string_view bytes, const Take& take) {
  if (auto* text = std::get_if<TextDecoder>(&decoder_)) return text->message(bytes, taking_arrivals(take));
  add(bytes, take);
  finish(take);
  std::get<FrameDecoder>(decoder_).release();
}

void Decoder::seek(std::uint64_t byte) {
  if (auto* text = std::get_if<TextDecoder>(&decoder_)) return text->seek(byte);
  decoder_.emplace<FrameDecoder>(faults_);
  offset_ = byte;
}

bool Decoder::wants_names() const noexcept {
  const auto* text = std::get_if<TextDecoder>(&decoder_);
  return text != nullptr && text->wants_names();
}

void Decoder::adopt_names(const Decoder& other, bool same_file) {
  auto* text = std::get_if<TextDecoder>(&decoder_);
  if (text != nullptr) text->adopt_names(std::get<TextDecoder>(other.decoder_), same_file);
}

std::uint64_t Decoder::end_of(const Arrival& arrival) const {
  if (const auto* frames = std::get_if<FrameDecoder>(&decoder_)) return offset_ + frames->message_end();
  return arrival.ends.empty() ? 0 : arrival.ends.back();
}

}  // namespace resonid::monitor
