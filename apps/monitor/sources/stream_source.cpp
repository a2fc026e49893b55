// SPDX-License-Identifier: MIT
#include "monitor/sources/stream_source.hpp"

#include <fmt/core.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "monitor/samples/arrival_copy.hpp"
#include "monitor/sources/thread_source.hpp"

namespace resonid::monitor {
namespace {

/// What a source has read and not delivered. The pipe does not give it again, and its writer goes on while a
/// change of the configuration replaces the source.
struct StreamRest {
  std::deque<ArrivalCopy> arrivals;
  std::string bytes;  ///< The beginning of a message.
  FaultLog unheard;
  Decoder names{Format{}, unheard};  ///< Knows the names of columns that a line has told.
};

/// What there is of every descriptor that was not read to its end.
class StreamRests {
 public:
  using Key = std::tuple<int, ::dev_t, ::ino_t>;  ///< A number alone may be that of another pipe later.

  static StreamRests& all() {
    static StreamRests rests;
    return rests;
  }
  static Key key_of(int descriptor) {
    struct ::stat status {};
    if (::fstat(descriptor, &status) != 0) return {descriptor, 0, 0};
    return {descriptor, status.st_dev, status.st_ino};
  }
  std::unique_ptr<StreamRest> take(const Key& key) {
    const std::lock_guard lock(mutex_);
    auto found = rests_.extract(key);
    return found ? std::move(found.mapped()) : std::make_unique<StreamRest>();
  }
  void put(const Key& key, std::unique_ptr<StreamRest> rest) {
    const std::lock_guard lock(mutex_);
    rests_[key] = std::move(rest);
  }

 private:
  std::mutex mutex_;
  std::map<Key, std::unique_ptr<StreamRest>> rests_;
};

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
    const auto key = StreamRests::key_of(settings_.descriptor);
    const bool learns = settings_.format.kind == SampleFormat::csv && settings_.format.columns.empty();
    rest_ = StreamRests::all().take(key);
    Decoder decoder(settings_.format, delivery_.faults());
    if (learns) decoder.adopt_names(rest_->names, true);
    const bool ended = deliver_rest(decoder) && follow(decoder);
    if (learns) rest_->names.adopt_names(decoder, true);
    if (!ended || !rest_->arrivals.empty()) StreamRests::all().put(key, std::move(rest_));
  }

  /// What the source before this one has left; false where this one is to stop as well.
  bool deliver_rest(Decoder& decoder) {
    std::vector<std::string_view> columns;
    for (; !rest_->arrivals.empty(); rest_->arrivals.pop_front())
      if (!deliver(rest_->arrivals.front().arrival(columns))) return false;
    const std::string bytes = std::exchange(rest_->bytes, {});
    decode(decoder, bytes);
    return true;
  }

  /// Whether the input was closed.
  bool follow(Decoder& decoder) {
    std::array<char, 65'536> buffer;
    set_state(SourceState::running);
    std::array<::pollfd, 1> input{{{settings_.descriptor, POLLIN, 0}}};
    while (wait(1.0, input)) {
      if (input[0].revents == 0) continue;
      const ::ssize_t bytes = ::read(settings_.descriptor, buffer.data(), buffer.size());
      if (bytes > 0) {
        delivery_.count_bytes(static_cast<std::uint64_t>(bytes));
        decode(decoder, {buffer.data(), static_cast<std::size_t>(bytes)});
      } else if (bytes == 0) {
        decoder.finish([&](const Message& message) { take(decoder, message); });
        rest_->bytes.clear();
        set_state(SourceState::ended, "the input was closed");
        return true;
      } else if (errno != EINTR && errno != EAGAIN) {
        set_state(SourceState::failed, fmt::format("cannot read: {}", system_error_text(errno)));
        return false;
      }
    }
    return false;
  }

  void decode(Decoder& decoder, std::string_view bytes) {
    decoder.add(bytes, [&](const Message& message) { take(decoder, message); });
    std::string& unfinished = rest_->bytes;
    decoded_ += bytes.size();
    if (frames()) {
      unfinished += bytes;
      const std::uint64_t left = std::min<std::uint64_t>(decoded_ - message_end_, kMostRest);
      if (unfinished.size() > left) unfinished.erase(0, unfinished.size() - left);
    } else if (const std::size_t line = bytes.rfind('\n'); line != std::string_view::npos) {
      unfinished = bytes.substr(line + 1);
    } else if (unfinished.size() <= kLongestLine) {  // of one that is too long so much tells that it is
      unfinished += bytes;
    }
  }

  void take(const Decoder& decoder, const Message& message) {
    const auto* arrival = std::get_if<Arrival>(&message);
    if (arrival == nullptr) return;
    if (frames()) message_end_ = decoder.end_of(*arrival);
    if (!deliver(*arrival)) rest_->arrivals.emplace_back(*arrival);
  }

  bool frames() const noexcept { return settings_.format.kind == SampleFormat::frame; }

  static constexpr std::uint64_t kMostRest = kLongestFrame + 65'536;

  const StreamSettings settings_;
  std::unique_ptr<StreamRest> rest_;
  std::uint64_t decoded_ = 0, message_end_ = 0;  ///< Bytes; up to the end of the newest frame.
};

}  // namespace

expected<std::unique_ptr<Source>, Error> make_stream_source(StreamSettings settings, Axes& axes) {
  if (settings.descriptor < 0) return refuse("descriptor", "must be >= 0", settings.descriptor);
  return std::make_unique<StreamSource>(std::move(settings), axes);
}

}  // namespace resonid::monitor
