// SPDX-License-Identifier: MIT
#include "monitor/samples/faults.hpp"

#include <utility>

#include "io/text_encoding.hpp"

namespace resonid::monitor {

std::string printable(std::string_view bytes, std::size_t most) {
  std::string text(bytes.substr(0, most));
  const bool cut = bytes.size() > most;  // perhaps within a character
  for (int k = 0; k < 3 && cut && !text.empty() && !io::is_utf8(text); ++k) text.pop_back();
  const bool plain = !io::is_utf8(text);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x20 || c == 0x7f || (plain && c >= 0x80)) text[i] = '?';
    // U+0080 ... U+009F are control characters too
    if (!plain && c == 0xC2 && static_cast<unsigned char>(text[i + 1]) < 0xA0) text.replace(i, 2, "?");
  }
  return text;
}

void FaultLog::note(Fault kind, std::string text) {
  const auto i = static_cast<std::size_t>(kind);
  counts_[i].fetch_add(1, std::memory_order_relaxed);
  const std::lock_guard lock(mutex_);
  examples_[i] = std::move(text);
  newest_ = i;
}

std::uint64_t FaultLog::total() const noexcept {
  std::uint64_t sum = 0;
  for (const auto& count : counts_) sum += count.load(std::memory_order_relaxed);
  return sum;
}

std::string FaultLog::example(Fault kind) const {
  const std::lock_guard lock(mutex_);
  return examples_[static_cast<std::size_t>(kind)];
}

std::string FaultLog::newest() const {
  const std::lock_guard lock(mutex_);
  return examples_[newest_];
}

}  // namespace resonid::monitor
