// SPDX-License-Identifier: MIT
#include "monitor/sources/stream_source.hpp"

#include <fmt/core.h>

#include <array>
#include <cerrno>

#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {
namespace {

class StreamSource final : public ThreadSource {
 public:
  StreamSource(StreamSettings settings, Axes& axes) : ThreadSource(axes), settings_(std::move(settings)) {}
  ~StreamSource() override { stop(); }
  [[nodiscard]] std::string_view promise() const noexcept override {
    return "What is in the pipe, and what the writer sends while nobody reads, is lost when the process is "
           "killed.";
  }

 private:
  void run() override {
    Decoder decoder(settings_.format, delivery_.faults());
    const auto take = [this](const Message& message) {
      if (const auto* arrival = std::get_if<Arrival>(&message)) static_cast<void>(deliver(*arrival));
    };
    std::array<char, 65'536> buffer;
    set_state(SourceState::running);
    std::array<::pollfd, 1> input{{{settings_.descriptor, POLLIN, 0}}};
    while (wait(1.0, input)) {
      if (input[0].revents == 0) continue;
      const ::ssize_t bytes = ::read(settings_.descriptor, buffer.data(), buffer.size());
      if (bytes > 0) {
        delivery_.count_bytes(static_cast<std::uint64_t>(bytes));
        decoder.add({buffer.data(), static_cast<std::size_t>(bytes)}, take);
      } else if (bytes == 0) {
        decoder.finish(take);
        return set_state(SourceState::ended, "the input was closed");
      } else if (errno != EINTR && errno != EAGAIN) {
        return set_state(SourceState::failed, fmt::format("cannot read: {}", system_error_text(errno)));
      }
    }
  }

  const StreamSettings settings_;
};

}  // namespace

expected<std::unique_ptr<Source>, Error> make_stream_source(StreamSettings settings, Axes& axes) {
  if (settings.descriptor < 0) return refuse("descriptor", "must be >= 0", settings.descriptor);
  return std::make_unique<StreamSource>(std::move(settings), axes);
}

}  // namespace resonid::monitor
