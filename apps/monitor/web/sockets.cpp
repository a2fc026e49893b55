// SPDX-License-Identifier: MIT
#include "monitor/web/sockets.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <deque>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <unordered_map>
#include <utility>
#include <variant>

#include "monitor/web/channel.hpp"
#include "monitor/web/framing.hpp"

namespace resonid::monitor::web {
namespace {

using Clock = std::chrono::steady_clock;
using Instant = Clock::time_point;

Clock::duration seconds(double s) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
}

/// What a stream has yet to send. Frames replace one another, alarms queue.
struct StreamQueue {
  static constexpr std::size_t kMostAlarms = 1000;  ///< One of each axis of a large installation at once.
  std::string axis;
  std::uint64_t last_id = 0;  ///< Alarms up to this one have been queued.
  std::deque<Text> alarms;
  Text frame, status, response;
  std::size_t turn = 0;  ///< Which of the three comes next.

  [[nodiscard]] Text next() {
    if (!alarms.empty()) {
      auto text = std::move(alarms.front());
      alarms.pop_front();
      return text;
    }
    const std::array<Text*, 3> waiting{&frame, &status, &response};
    for (std::size_t i = 0; i < waiting.size();
         ++i)  // in turn, or frames would keep the others from a slow client
      if (auto& text = *waiting[(turn + i) % waiting.size()]) {
        turn = (turn + i + 1) % waiting.size();
        return std::exchange(text, nullptr);
      }
    return nullptr;
  }
};

struct Connection {
  enum class Phase : std::uint8_t {
    reading,    ///< Gathers a request.
    answering,  ///< A worker has it.
    sending,
    streaming,
    closing,  ///< All is sent; waits for the client to close, or bytes under way would take the answer back.
  };
  Connection(Channel opened, std::string from) : channel(std::move(opened)), client(std::move(from)) {}

  Channel channel;
  std::string client;
  bool counts = true;  ///< Against the limit; not those that are only told that it is reached.
  Phase phase = Phase::reading;
  std::string received;
  Text out;
  std::size_t sent = 0;
  bool close_after = false;
  std::optional<StreamQueue> stream;
  std::shared_ptr<const void> download;
  std::size_t unsent = 0;  ///< As counted against the limit.
  Instant began;           ///< When the answer did.
  Instant since;  ///< When the phase, or within it the request, began; of a stream the last byte sent.
  std::uint32_t interest = 0;
};

/// Requests of one client's address: a bucket that fills steadily.
struct Bucket {
  double tokens = 0.0;
  Instant at;
};

struct Done {
  std::uint64_t connection = 0;
  Reply reply;
};
using Message = std::variant<Done, FeedEvent>;

struct Job {
  std::uint64_t connection = 0;
  std::string request;
  std::size_t head = 0;
  std::string client;
};

class EpollSockets final : public Sockets {
 public:
  EpollSockets(const WebLimits& limits, TlsContext tls, Descriptor listener, Descriptor epoll,
               Descriptor wake, std::uint16_t port)
      : limits_(limits),
        tls_(std::move(tls)),
        listener_(std::move(listener)),
        epoll_(std::move(epoll)),
        wake_(std::move(wake)),
        spare_(::open("/dev/null", O_RDONLY | O_CLOEXEC)),
        port_(port) {}
  ~EpollSockets() override { stop(); }

  void start(const std::function<Answerer()>& answerer,
             std::function<Feed::Beginning(const std::string&)> begin) override {
    begin_ = std::move(begin);
    for (std::uint32_t i = 0; i < limits_.workers; ++i)
      workers_.emplace_back([this, answer = answerer()] { work(answer); });
    loop_ = std::thread([this] { loop(); });
  }

  void send(FeedEvent event) override { post(std::move(event)); }

  [[nodiscard]] std::set<std::string> watched() const override {
    const std::lock_guard lock(shared_mutex_);
    std::set<std::string> names;
    for (const auto& [name, count] : watched_) names.insert(name);
    return names;
  }
  [[nodiscard]] SocketCounts counts() const override {
    const std::lock_guard lock(shared_mutex_);
    return counts_;
  }
  [[nodiscard]] std::uint16_t port() const noexcept override { return port_; }

  void stop() override {
    if (!stopping_.exchange(true)) wake();
    if (loop_.joinable()) loop_.join();
    {
      const std::lock_guard lock(jobs_mutex_);
      jobs_end_ = true;
    }
    jobs_came_.notify_all();
    for (auto& worker : workers_) worker.join();
    workers_.clear();
  }

 private:
  using Phase = Connection::Phase;
  static constexpr std::uint64_t kListener = 0, kWake = 1;
  static constexpr std::size_t kMostExtra = 64;  ///< Connections that are told that there are too many.
  static constexpr std::size_t kShort = 16'384;  ///< Bytes of an answer that is always sent.

  // ---- from other threads

  void wake() const {
    const std::uint64_t one = 1;
    static_cast<void>(!::write(wake_.get(), &one, sizeof one));  // full: it is awake
  }
  void post(Message message) {
    bool first = false;
    {
      const std::lock_guard lock(messages_mutex_);
      first = messages_.empty();
      messages_.push_back(std::move(message));
    }
    if (first) wake();
  }
  void work(const Answerer& answer) {
    for (;;) {
      Job job;
      {
        std::unique_lock lock(jobs_mutex_);
        jobs_came_.wait(lock, [this] { return jobs_end_ || !jobs_.empty(); });
        if (jobs_end_) return;
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
      post(Done{job.connection, answer(job.request, job.head, job.client)});
    }
  }

  // ---- the loop

  void loop() {
    std::array<::epoll_event, 128> events{};
    auto next_check = Clock::now();
    Instant end{};
    for (;;) {
      const int count = ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), 100);
      now_ = Clock::now();
      for (int i = 0; i < count; ++i) {
        const auto id = events[static_cast<std::size_t>(i)].data.u64;
        if (id == kListener)
          accept_all();
        else if (id == kWake)
          read_wake();
        else
          go_on(id);
      }
      take_messages();
      if (now_ >= next_check) {
        check_deadlines();
        next_check = now_ + std::chrono::milliseconds(100);
      }
      if (!stopping_) continue;
      if (listener_.get() >= 0) {
        listener_.close();
        end = now_ + std::chrono::seconds(2);
      }
      const bool busy = std::any_of(connections_.begin(), connections_.end(), [](const auto& c) {
        return c.second->phase == Phase::answering || c.second->phase == Phase::sending;
      });
      if (!busy || now_ >= end) break;
    }
    while (!connections_.empty()) drop(connections_.begin()->first);
  }

  void read_wake() const {
    std::uint64_t count = 0;
    static_cast<void>(!::read(wake_.get(), &count, sizeof count));
  }

  void take_messages() {
    std::vector<Message> messages;
    {
      const std::lock_guard lock(messages_mutex_);
      messages.swap(messages_);
    }
    for (auto& message : messages) {
      if (auto* done = std::get_if<Done>(&message))
        answered(*done);
      else
        broadcast(std::get<FeedEvent>(message));
    }
  }

  void accept_all() {
    for (int i = 0; i < 64; ++i) {
      ::sockaddr_storage address{};
      ::socklen_t size = sizeof address;
      Descriptor socket(::accept4(listener_.get(), reinterpret_cast<::sockaddr*>(&address), &size,
                                  SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (socket.get() < 0 && (errno == EMFILE || errno == ENFILE)) {
        // Without a free descriptor it would wait there, and wake the loop again and again.
        spare_.close();
        Descriptor(::accept(listener_.get(), nullptr, nullptr)).close();
        spare_ = Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC));
        count_refused();
        return;
      }
      if (socket.get() < 0) return;
      add(std::move(socket), address_text(address));
    }
  }

  void add(Descriptor socket, std::string client) {
    if (counted_ >= limits_.connections) close_idle_one();
    const bool full = counted_ >= limits_.connections,
               enough = has_enough(client_connections_, client, limits_.client_connections);
    const bool refused = full || enough;
    if (refused) count_refused();
    if (refused && (tls_ || connections_.size() - counted_ >= kMostExtra)) return;
    const int on = 1;
    ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    Tls tls;
    if (tls_) {
      tls.reset(SSL_new(tls_.get()));
      if (!tls || SSL_set_fd(tls.get(), socket.get()) != 1) return;
      SSL_set_accept_state(tls.get());
    }
    const auto id = next_id_++;
    auto made = std::make_unique<Connection>(Channel(std::move(socket), std::move(tls)), std::move(client));
    auto& connection = *made;
    connection.since = now_;
    connection.interest = EPOLLIN;
    ::epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = id;
    if (::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, connection.channel.fd(), &event) != 0) return;
    connections_.emplace(id, std::move(made));
    connection.counts = !refused;
    counted_ += connection.counts;
    if (connection.counts) ++client_connections_[connection.client];
    publish_counts();
    if (full)
      send_reply(id, connection, refusal(503, "connections", "too many connections are open"));
    else if (enough)
      send_reply(id, connection,
                 refusal(429, "connections", "more connections than one client may have open"));
  }

  /// Makes room: the connection that has waited longest, for more than a second, without a whole request.
  void close_idle_one() {
    std::uint64_t oldest = 0;
    auto since = now_ - std::chrono::seconds(1);
    for (const auto& [id, connection] : connections_)
      if (connection->counts && connection->phase == Phase::reading && connection->since < since) {
        oldest = id;
        since = connection->since;
      }
    if (oldest != 0) drop(oldest);
  }

  void drop(std::uint64_t id) {
    const auto found = connections_.find(id);
    if (found == connections_.end()) return;
    const auto& connection = *found->second;
    counted_ -= connection.counts;
    if (connection.counts) take_from(client_connections_, connection.client);
    if (connection.stream) end_stream(*connection.stream, connection.client);
    end_answer(*found->second);
    connections_.erase(found);  // which closes it, and so takes it out of epoll
    publish_counts();
  }

  void go_on(std::uint64_t id) {
    const auto found = connections_.find(id);
    if (found == connections_.end()) return;
    auto& connection = *found->second;
    switch (connection.phase) {
      case Phase::reading:
        read(id, connection);
        break;
      case Phase::answering:  // gone, since nothing else is waited for: the answer will not be needed
        drop(id);
        break;
      case Phase::sending:
        write(id, connection);
        break;
      case Phase::streaming:
      case Phase::closing:
        if (discard(connection))
          drop(id);
        else if (connection.phase == Phase::streaming)
          write(id, connection);
        break;
    }
  }

  /// Throws away what a client sends that has nothing to say; whether it has closed.
  static bool discard(Connection& connection) {
    std::array<char, 4096> bytes;
    for (int i = 0; i < 16; ++i) {
      const auto moved = connection.channel.read(bytes.data(), bytes.size());
      if (moved.end == Moved::End::closed) return true;
      if (moved.end != Moved::End::some) return false;
    }
    return false;
  }

  void wait_for(std::uint64_t id, Connection& connection, std::uint32_t interest) {
    if (connection.interest == interest) return;
    connection.interest = interest;
    ::epoll_event event{};
    event.events = interest;
    event.data.u64 = id;
    ::epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, connection.channel.fd(), &event);
  }

  void read(std::uint64_t id, Connection& connection) {
    std::array<char, 16384> bytes;
    while (connection.received.size() <= limits_.head_bytes + 4 + limits_.body_bytes) {
      if (dispatch(id, connection)) return;
      const auto moved = connection.channel.read(bytes.data(), bytes.size());
      if (moved.end == Moved::End::closed) return drop(id);
      if (moved.end != Moved::End::some) {
        wait_for(id, connection, moved.end == Moved::End::wants_write ? EPOLLOUT : EPOLLIN);
        return;
      }
      if (connection.received.empty()) connection.since = now_;
      connection.received.append(bytes.data(), moved.bytes);
    }
    if (!dispatch(id, connection)) drop(id);
  }

  /// Gives a whole request to a worker, or refuses it; false: there is none yet.
  bool dispatch(std::uint64_t id, Connection& connection) {
    if (connection.received.empty()) return false;
    const auto size = request_size(connection.received, limits_);
    if (size.refusal != 0) {
      send_reply(id, connection, refusal(size.refusal, "request", size.message));
      return true;
    }
    const auto whole = size.head + size.body;
    if (size.head == 0 || connection.received.size() < whole) return false;
    if (!within_rate(connection.client)) {
      count_refused();
      send_reply(id, connection, refusal(429, "rate", "more requests than one client may send"));
      return true;
    }
    Job job{id, connection.received.substr(0, whole), size.head, connection.client};
    connection.received.erase(0, whole);
    connection.phase = Phase::answering;
    wait_for(id, connection, 0);
    {
      const std::lock_guard lock(jobs_mutex_);
      jobs_.push_back(std::move(job));
    }
    jobs_came_.notify_one();
    return true;
  }

  bool within_rate(const std::string& client) {
    if (buckets_.size() > 10'000) buckets_.clear();  // memory before justice
    auto& bucket = buckets_.try_emplace(client, Bucket{limits_.burst, now_}).first->second;
    const double passed = std::chrono::duration<double>(now_ - bucket.at).count();
    bucket.tokens = std::min(limits_.burst, bucket.tokens + passed * limits_.requests_per_second);
    bucket.at = now_;
    if (bucket.tokens < 1.0) return false;
    bucket.tokens -= 1.0;
    return true;
  }

  using PerClient = std::unordered_map<std::string, std::size_t>;
  static bool has_enough(const PerClient& all, const std::string& client, std::size_t most) {
    const auto found = all.find(client);
    return found != all.end() && found->second >= most && !is_this_machine(client);
  }
  static void take_from(PerClient& all, const std::string& client) {
    if (--all[client] == 0) all.erase(client);
  }

  /// Whether so much more would be too much in memory. A download of any length is sent where it is alone.
  [[nodiscard]] bool too_much(const Reply& reply) const {
    if (reply.stream || reply.text.size() <= kShort) return false;
    const std::size_t unsent = unsent_[reply.download != nullptr];
    return unsent + reply.text.size() > limits_.unsent_bytes && !(reply.download && unsent == 0);
  }
  void end_answer(Connection& connection) {
    unsent_[connection.download != nullptr] -= std::exchange(connection.unsent, 0);
    connection.download = nullptr;
  }

  void answered(Done& done) {
    const auto found = connections_.find(done.connection);
    if (found == connections_.end()) return;
    auto& connection = *found->second;
    if (done.reply.stream && streams_ >= limits_.streams) {
      count_refused();
      done.reply = refusal(503, "streams", "too many event streams are open");
    } else if (done.reply.stream && has_enough(client_streams_, connection.client, limits_.client_streams)) {
      count_refused();
      done.reply = refusal(429, "streams", "more event streams than one client may have open");
    } else if (too_much(done.reply)) {
      count_refused();
      done.reply = refusal(503, "answers", "too much waits to be taken by clients");
    }
    if (done.reply.stream) {
      StreamQueue stream;
      stream.axis = done.reply.axis;
      auto beginning = begin_(done.reply.last_event_id);
      stream.alarms.assign(beginning.texts.begin(), beginning.texts.end());
      stream.last_id = beginning.id;
      begin_stream(stream, connection.client);
      connection.stream = std::move(stream);
      // A little is enough, or a slow client gets old frames for seconds.
      const int bytes = 128 * 1024;
      ::setsockopt(connection.channel.fd(), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    }
    send_reply(done.connection, connection, std::move(done.reply));
  }

  void send_reply(std::uint64_t id, Connection& connection, Reply reply) {
    {
      const std::lock_guard lock(shared_mutex_);
      ++counts_.responses[reply.status];
    }
    connection.download = std::move(reply.download);
    connection.unsent = reply.stream ? 0 : reply.text.size();
    unsent_[connection.download != nullptr] += connection.unsent;
    connection.out = std::make_shared<const std::string>(std::move(reply.text));
    connection.sent = 0;
    connection.close_after = reply.close;
    connection.phase = reply.stream ? Phase::streaming : Phase::sending;
    connection.since = connection.began = now_;
    write(id, connection);
  }

  /// Sends as much as the client takes.
  void write(std::uint64_t id, Connection& connection) {
    for (;;) {
      if (connection.out && connection.sent == connection.out->size()) connection.out = nullptr;
      if (!connection.out) {
        connection.sent = 0;
        if (connection.stream) connection.out = connection.stream->next();
      }
      if (!connection.out) break;
      const auto rest = std::string_view(*connection.out).substr(connection.sent);
      const auto moved = connection.channel.write(rest.data(), rest.size());
      if (moved.end == Moved::End::closed) return drop(id);
      if (moved.end != Moved::End::some) {
        const bool stream = connection.phase == Phase::streaming;
        const std::uint32_t way = moved.end == Moved::End::wants_write ? EPOLLOUT : EPOLLIN;
        return wait_for(id, connection, stream ? way | EPOLLIN : way);
      }
      connection.sent += moved.bytes;
      connection.since = now_;
    }
    if (connection.phase == Phase::streaming) return wait_for(id, connection, EPOLLIN);
    end_answer(connection);
    connection.since = now_;
    if (connection.close_after || stopping_) {
      connection.channel.finish();
      connection.phase = Phase::closing;
      return wait_for(id, connection, EPOLLIN);
    }
    connection.phase = Phase::reading;
    wait_for(id, connection, EPOLLIN);
    read(id, connection);  // the next one may be there already
  }

  void broadcast(const FeedEvent& event) {
    using Kind = FeedEvent::Kind;
    std::vector<std::uint64_t> ids;
    for (const auto& [id, connection] : connections_)
      if (connection->stream) ids.push_back(id);
    for (const auto id : ids) {
      auto& connection = *connections_.at(id);
      auto& stream = *connection.stream;
      if (!event.axis.empty() && event.axis != stream.axis) continue;
      if (event.kind == Kind::alarm) {
        if (event.id <= stream.last_id) continue;
        stream.last_id = event.id;
        stream.alarms.push_back(event.text);
        if (stream.alarms.size() > StreamQueue::kMostAlarms) {  // it comes again with the id that it has
          drop(id);
          continue;
        }
      } else {
        auto& waiting = event.kind == Kind::frame  ? stream.frame
                        : event.kind == Kind::axis ? stream.status
                                                   : stream.response;
        if (std::exchange(waiting, event.text)) {
          const std::lock_guard lock(shared_mutex_);
          ++counts_.skipped_frames;
        }
      }
      if (!(connection.interest & EPOLLOUT)) write(id, connection);
    }
  }

  void check_deadlines() {
    std::vector<std::uint64_t> late, slow, silent;
    for (const auto& [id, connection] : connections_) {
      const auto waited = now_ - connection->since;
      switch (connection->phase) {
        case Phase::reading:
          if (connection->received.empty() && waited > seconds(limits_.idle_s)) late.push_back(id);
          if (!connection->received.empty() && waited > seconds(limits_.request_s)) slow.push_back(id);
          break;
        case Phase::answering:
          break;
        case Phase::sending: {
          // Or a client that takes a byte now and then would keep all of it here.
          const double most_s =
              limits_.answer_s + static_cast<double>(connection->unsent) / limits_.answer_bytes_per_second;
          if (waited > seconds(limits_.stalled_s) || now_ - connection->began > seconds(most_s))
            late.push_back(id);
          break;
        }
        case Phase::streaming:
          if (connection->out && waited > seconds(limits_.stalled_s)) late.push_back(id);
          if (!connection->out && waited > seconds(limits_.keep_alive_s)) silent.push_back(id);
          break;
        case Phase::closing:
          if (waited > std::chrono::seconds(1)) late.push_back(id);
          break;
      }
    }
    for (const auto id : late) drop(id);
    for (const auto id : slow)
      send_reply(id, *connections_.at(id), refusal(408, "request", "did not come to its end in time"));
    static const Text kComment = std::make_shared<const std::string>(": keep-alive\n\n");
    for (const auto id : silent) {
      auto& connection = *connections_.at(id);
      connection.out = kComment;
      connection.sent = 0;
      write(id, connection);
    }
  }

  // ---- what other threads look at

  void publish_counts() {
    const std::lock_guard lock(shared_mutex_);
    counts_.connections = counted_;
    counts_.streams = streams_;
  }
  void count_refused() {
    const std::lock_guard lock(shared_mutex_);
    ++counts_.refused;
  }
  void begin_stream(const StreamQueue& stream, const std::string& client) {
    ++streams_;
    ++client_streams_[client];
    publish_counts();
    const std::lock_guard lock(shared_mutex_);
    if (!stream.axis.empty()) ++watched_[stream.axis];
  }
  void end_stream(const StreamQueue& stream, const std::string& client) {
    --streams_;
    take_from(client_streams_, client);
    const std::lock_guard lock(shared_mutex_);
    if (!stream.axis.empty() && --watched_[stream.axis] == 0) watched_.erase(stream.axis);
  }

  const WebLimits limits_;
  const TlsContext tls_;
  Descriptor listener_, epoll_, wake_, spare_;
  const std::uint16_t port_;
  std::function<Feed::Beginning(const std::string&)> begin_;
  std::atomic<bool> stopping_{false};
  std::thread loop_;
  std::vector<std::thread> workers_;

  // The loop's own.
  Instant now_ = Clock::now();
  std::unordered_map<std::uint64_t, std::unique_ptr<Connection>> connections_;
  std::uint64_t next_id_ = 2;
  std::size_t counted_ = 0, streams_ = 0;
  std::unordered_map<std::string, Bucket> buckets_;
  PerClient client_streams_, client_connections_;
  std::array<std::size_t, 2> unsent_{};  ///< [download] Bytes of answers that are not yet sent as a whole.

  std::mutex messages_mutex_;
  std::vector<Message> messages_;

  std::mutex jobs_mutex_;
  std::condition_variable jobs_came_;
  std::deque<Job> jobs_;
  bool jobs_end_ = false;

  mutable std::mutex shared_mutex_;
  std::map<std::string, std::uint32_t> watched_;
  SocketCounts counts_;
};

}  // namespace

expected<std::unique_ptr<Sockets>, Error> Sockets::listen(const Listening& listening,
                                                          const WebLimits& limits) {
  auto tls = tls_context(listening);
  if (!tls) return unexpected<Error>(tls.error());
  auto listener = listening_socket(listening);
  if (!listener) return unexpected<Error>(listener.error());
  ::sockaddr_storage address{};
  ::socklen_t size = sizeof address;
  Descriptor epoll(::epoll_create1(EPOLL_CLOEXEC)), wake(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  const auto watch = [&](int fd, std::uint64_t id) {
    ::epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = id;
    return ::epoll_ctl(epoll.get(), EPOLL_CTL_ADD, fd, &event) == 0;
  };
  if (::getsockname(listener->get(), reinterpret_cast<::sockaddr*>(&address), &size) != 0 ||
      !watch(listener->get(), 0) || !watch(wake.get(), 1))
    return cannot_listen(listening, std::generic_category().message(errno));
  const auto port =
      ntohs(address.ss_family == AF_INET ? reinterpret_cast<::sockaddr_in&>(address).sin_port
                                         : reinterpret_cast<::sockaddr_in6&>(address).sin6_port);
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to sockets without asking for its absence
  return std::make_unique<EpollSockets>(limits, std::move(*tls), std::move(*listener), std::move(epoll),
                                        std::move(wake), port);
}

}  // namespace resonid::monitor::web
