// SPDX-License-Identifier: MIT
#include "monitor/sources/tcp_connection.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <utility>
#include <vector>

namespace resonid::monitor {
namespace {

constexpr std::size_t kMostAnswers = 65'536;  // bytes that wait for the client to read them

}  // namespace

TcpConnection::TcpConnection(Descriptor socket, const Format& format, Delivery& delivery)
    : socket_(std::move(socket)),
      decoder_(format, delivery.faults()),
      delivery_(delivery),
      answers_frames_(format.kind == SampleFormat::frame) {}

short TcpConnection::events() const noexcept {
  const bool reads = !ended_ && kept_.empty() && answers_.size() < kMostAnswers;
  return static_cast<short>((reads ? POLLIN : 0) | (answers_.empty() ? 0 : POLLOUT));
}

void TcpConnection::receive(std::span<char> buffer) {
  const ::ssize_t bytes = ::recv(socket_.get(), buffer.data(), buffer.size(), 0);
  if (bytes < 0 && (errno == EINTR || errno == EAGAIN)) return;
  if (bytes <= 0) {  // closed, or broken off, which nobody can tell apart
    ended_ = true;
    return decoder_.break_off();
  }
  const auto count = static_cast<std::size_t>(bytes);
  last_ = Clock::now();
  delivery_.count_bytes(count);
  unfinished_ += count;
  decoder_.add({buffer.data(), count}, [this](const Message& message) { take(message); });
}

void TcpConnection::take(const Message& message) {
  unfinished_ = 0;
  if (const auto* arrival = std::get_if<Arrival>(&message)) {
    if (!kept_.empty() || !handle(*arrival)) kept_.push_back({ArrivalCopy(*arrival)});
  } else if (const auto* question = std::get_if<Question>(&message)) {
    if (kept_.empty()) return answer(question->axis);
    Arrival asked;
    asked.axis = question->axis;
    kept_.push_back({ArrivalCopy(asked), true});
  } else {
    delivery_.faults().note(Fault::format, "an acknowledgement by a client; frames are required");
  }
}

/// False where there is no room for it.
bool TcpConnection::handle(const Arrival& arrival) {
  const auto outcome = delivery_.add(arrival);
  if (outcome == Intake::Outcome::full) return false;
  useful_ = useful_ || outcome != Intake::Outcome::refused;
  if (answers_frames_) answer(arrival.axis);
  return true;
}

void TcpConnection::answer(std::string_view axis) {
  const Intake* const intake = delivery_.find(axis);
  useful_ = useful_ || intake != nullptr;
  answers_ += encoded(Acknowledgement{axis, intake ? intake->next_for_sender() : Acknowledgement::kRefused});
}

void TcpConnection::deliver_kept() {
  std::vector<std::string_view> columns;
  while (!kept_.empty()) {
    const Kept& kept = kept_.front();
    if (kept.question)
      answer(kept.message.axis());
    else if (!handle(kept.message.arrival(columns)))
      return;
    kept_.pop_front();
    last_ = Clock::now();
  }
}

void TcpConnection::send() {
  while (!answers_.empty()) {
    const ::ssize_t bytes = ::send(socket_.get(), answers_.data(), answers_.size(), MSG_NOSIGNAL);
    if (bytes < 0 && errno == EAGAIN) return;
    if (bytes < 0 && errno == EINTR) continue;
    if (bytes < 0) {  // the client is gone; what it sent is used all the same
      answers_.clear();
      ended_ = true;
      return;
    }
    answers_.erase(0, static_cast<std::size_t>(bytes));
  }
}

}  // namespace resonid::monitor
