// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "monitor/brokers/nats_handles.hpp"
#include "monitor/brokers/nats_subject.hpp"
#include "monitor/brokers/publisher.hpp"
#include "monitor/samples/faults.hpp"

namespace resonid::monitor {
namespace {

constexpr std::int64_t kConfirm_ms = 5000;
constexpr auto kNatsGoodbye = std::chrono::milliseconds(300);  // for a server that answers
constexpr const char* kMessageId = "Nats-Msg-Id";

unexpected<Error> not_told(std::string why) { return unexpected<Error>(Error{"publisher", std::move(why)}); }

struct NatsNotice {
  std::string subject, key, text;
};

/// Makes the connection and sends by it; each may take seconds.
class NatsSending {
 public:
  NatsSending(NatsSettings settings, bool stored) : settings_(std::move(settings)), stored_(stored) {}

  /// @param go_on asked once there is a connection
  template <class GoOn>
  [[nodiscard]] expected<void, Error> send(const NatsNotice& notice, const GoOn& go_on) {
    if (!connection_ || connection_->closed()) {
      auto opened = NatsConnection::open(settings_);
      if (!opened)
        return not_told(
            fmt::format("{}: {}", opened.error().where.view(), opened.error().requirement.view()));
      connection_ = std::move(*opened);
    }
    if (!connection_->connected()) return not_told("no server answers");
    if (!go_on()) return not_told("interrupted");
    NatsMessage message;
    natsStatus status = nats_read(message, [&](natsMsg** raw) {
      return natsMsg_Create(raw, notice.subject.c_str(), nullptr, notice.text.data(),
                            static_cast<int>(notice.text.size()));
    });
    if (status == NATS_OK) status = natsMsgHeader_Set(message.get(), kMessageId, notice.key.c_str());
    if (status == NATS_OK) status = stored_ ? store(message.get()) : send(message.get());
    if (status != NATS_OK) return not_told(fmt::format("'{}': {}", notice.subject, nats_text(status)));
    return {};
  }
  void close() { connection_.reset(); }

 private:
  [[nodiscard]] natsStatus store(natsMsg* message) const {
    JetStreamHandle js;
    jsOptions options;
    jsOptions_Init(&options);
    options.Wait = kConfirm_ms;
    const natsStatus status = nats_read(
        js, [&](jsCtx** raw) { return natsConnection_JetStream(raw, connection_->get(), &options); });
    return status == NATS_OK ? js_PublishMsg(nullptr, js.get(), message, nullptr, nullptr) : status;
  }

  /// The server answers a ping after it has taken, or refused, what came before.
  [[nodiscard]] natsStatus send(natsMsg* message) {
    natsStatus status = natsConnection_PublishMsg(connection_->get(), message);
    if (status == NATS_OK) status = natsConnection_FlushTimeout(connection_->get(), kConfirm_ms);
    const char* details = nullptr;
    if (status == NATS_OK) status = natsConnection_GetLastError(connection_->get(), &details);
    if (status != NATS_OK) connection_.reset();  // it would remember the error
    return status;
  }

  NatsSettings settings_;
  bool stored_;
  std::unique_ptr<NatsConnection> connection_;
};

/// The library's waits cannot be cut short: they are those of a thread that a publisher in a hurry leaves
/// behind, to end by itself.
class NatsPublisher final : public Publisher {
 public:
  NatsPublisher(NatsSettings settings, bool stored)
      : thread_([work = work_, sending = NatsSending(std::move(settings), stored)]() mutable {
          run(*work, sending);
        }) {}
  NatsPublisher(const NatsPublisher&) = delete;
  NatsPublisher& operator=(const NatsPublisher&) = delete;
  ~NatsPublisher() override {
    NatsPublisher::interrupt();
    std::unique_lock lock(work_->mutex);
    work_->changed.wait_for(lock, kNatsGoodbye, [this] { return work_->ended; });
    thread_.detach();
  }

  [[nodiscard]] expected<void, Error> publish(std::string_view key, std::string_view topic,
                                              std::string_view body) override {
    auto text = with_key(body, key);
    if (!text) return unexpected(text.error());
    if (!is_subject_filter(topic) || topic.find_first_of("*>") != std::string_view::npos)
      return refuse("topic",
                    fmt::format("'{}' is no subject; one without wildcards is required", printable(topic)));
    std::unique_lock lock(work_->mutex);
    if (work_->interrupted) return not_told("interrupted");
    work_->due = NatsNotice{std::string(topic), std::string(key), std::move(*text)};
    work_->changed.notify_all();
    work_->changed.wait(lock, [this] { return work_->done || work_->interrupted; });
    if (!work_->done) return not_told("interrupted");
    return *std::exchange(work_->done, std::nullopt);
  }
  void interrupt() override {
    const std::lock_guard lock(work_->mutex);
    work_->interrupted = true;
    work_->changed.notify_all();
  }

 private:
  struct Work {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<NatsNotice> due;
    std::optional<expected<void, Error>> done;
    bool interrupted = false, ended = false;
  };

  static void run(Work& work, NatsSending& sending) {
    const auto go_on = [&work] {
      const std::lock_guard lock(work.mutex);
      return !work.interrupted;
    };
    std::unique_lock lock(work.mutex);
    while (true) {
      work.changed.wait(lock, [&] { return work.due || work.interrupted; });
      if (work.interrupted) break;
      const NatsNotice notice = *std::exchange(work.due, std::nullopt);
      lock.unlock();
      auto done = sending.send(notice, go_on);
      lock.lock();
      work.done = std::move(done);
      work.changed.notify_all();
    }
    lock.unlock();
    sending.close();
    lock.lock();
    work.ended = true;
    work.changed.notify_all();
  }

  std::shared_ptr<Work> work_ = std::make_shared<Work>();
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Publisher> make_nats_publisher(NatsSettings settings, bool stored) {
  return std::make_unique<NatsPublisher>(std::move(settings), stored);
}

}  // namespace resonid::monitor
