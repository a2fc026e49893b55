// SPDX-License-Identifier: MIT
#include "monitor/web/sockets.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/core.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
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

#include "monitor/web/api_json.hpp"

namespace resonid::monitor {
namespace {

using Clock = std::chrono::steady_clock;
using Instant = Clock::time_point;

Clock::duration seconds(double s) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
}

/// An open descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) noexcept : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const noexcept { return fd_; }
  void close() noexcept { *this = Descriptor(); }

 private:
  int fd_;
};

template <auto Free>
struct FreeWith {
  template <class T>
  void operator()(T* pointer) const noexcept {
    Free(pointer);
  }
};
using TlsContext = std::unique_ptr<SSL_CTX, FreeWith<SSL_CTX_free>>;
using Tls = std::unique_ptr<SSL, FreeWith<SSL_free>>;

/// What came of reading or writing without waiting.
struct Moved {
  enum class End : std::uint8_t { some, wants_read, wants_write, closed } end = End::closed;
  std::size_t bytes = 0;
};

/// A client's connection, plain or TLS.
class Channel {
 public:
  Channel(Descriptor socket, Tls tls) : socket_(std::move(socket)), tls_(std::move(tls)) {}

  [[nodiscard]] Moved read(char* to, std::size_t size) {
    if (tls_) {
      std::size_t bytes = 0;
      ERR_clear_error();
      const int result = SSL_read_ex(tls_.get(), to, size, &bytes);
      return tls_result(result, bytes);
    }
    const auto bytes = ::recv(fd(), to, size, 0);
    return plain_result(bytes, Moved::End::wants_read);
  }
  [[nodiscard]] Moved write(const char* from, std::size_t size) {
    if (tls_) {
      std::size_t bytes = 0;
      ERR_clear_error();
      const int result = SSL_write_ex(tls_.get(), from, size, &bytes);
      return tls_result(result, bytes);
    }
    const auto bytes = ::send(fd(), from, size, MSG_NOSIGNAL);
    return plain_result(bytes, Moved::End::wants_write);
  }
  /// Nothing more is sent.
  void finish() {
    ERR_clear_error();
    if (tls_ && SSL_is_init_finished(tls_.get())) static_cast<void>(SSL_shutdown(tls_.get()));
    ::shutdown(fd(), SHUT_WR);
    tls_.reset();  // what still comes is not looked at
  }
  [[nodiscard]] int fd() const noexcept { return socket_.get(); }

 private:
  static Moved plain_result(::ssize_t bytes, Moved::End wants) {
    if (bytes > 0) return {Moved::End::some, static_cast<std::size_t>(bytes)};
    if (bytes < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return {wants, 0};
    return {Moved::End::closed, 0};
  }
  [[nodiscard]] Moved tls_result(int result, std::size_t bytes) const {
    if (result == 1) return {Moved::End::some, bytes};
    switch (SSL_get_error(tls_.get(), result)) {
      case SSL_ERROR_WANT_READ:
        return {Moved::End::wants_read, 0};
      case SSL_ERROR_WANT_WRITE:
        return {Moved::End::wants_write, 0};
      default:
        return {Moved::End::closed, 0};
    }
  }

  Descriptor socket_;
  Tls tls_;
};

/// What a stream has yet to send. Frames replace one another, alarms queue.
struct StreamQueue {
  static constexpr std::size_t kMostAlarms = Feed::kRemembered + 1;
  std::string axis;
  std::uint64_t last_id = 0;  ///< Alarms up to this one have been queued.
  std::deque<Text> alarms;
  Text frame, status, response;

  [[nodiscard]] Text next() {
    if (!alarms.empty()) {
      auto text = std::move(alarms.front());
      alarms.pop_front();
      return text;
    }
    for (auto* waiting : {&frame, &status, &response})
      if (*waiting) return std::exchange(*waiting, nullptr);
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

unexpected<Error> cannot_listen(const Listening& where, std::string_view why) {
  return unexpected<Error>(
      Error{"listen", fmt::format("cannot listen on {} port {}: {}", where.address, where.port, why)});
}

std::string last_error() { return std::generic_category().message(errno); }

expected<TlsContext, Error> tls_context(const Listening& listening) {
  if (listening.certificate_file.empty() != listening.key_file.empty())
    return refuse(listening.key_file.empty() ? "key_file" : "certificate_file",
                  "is required too: TLS needs a certificate and its key");
  if (listening.key_file.empty()) return TlsContext();
  TlsContext context(SSL_CTX_new(TLS_server_method()));
  if (!context) return refuse("certificate_file", "TLS cannot be set up");
  SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
  SSL_CTX_set_mode(context.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                      SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_set_options(context.get(), SSL_OP_NO_RENEGOTIATION);
  ERR_clear_error();
  const auto refused = [](const char* field, const std::string& file) {
    std::array<char, 256> why{};
    ERR_error_string_n(ERR_get_error(), why.data(), why.size());
    return unexpected<Error>(Error{field, fmt::format("cannot be used: {}", why.data()), std::nan(""), file});
  };
  if (SSL_CTX_use_certificate_chain_file(context.get(), listening.certificate_file.c_str()) != 1)
    return refused("certificate_file", listening.certificate_file);
  if (SSL_CTX_use_PrivateKey_file(context.get(), listening.key_file.c_str(), SSL_FILETYPE_PEM) != 1 ||
      SSL_CTX_check_private_key(context.get()) != 1)
    return refused("key_file", listening.key_file);
  return context;
}

expected<Descriptor, Error> listening_socket(const Listening& where) {
  ::addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  ::addrinfo* found = nullptr;
  const auto port = std::to_string(where.port);
  if (const int code = ::getaddrinfo(where.address.c_str(), port.c_str(), &hints, &found); code != 0)
    return cannot_listen(where, ::gai_strerror(code));
  const std::unique_ptr<::addrinfo, FreeWith<::freeaddrinfo>> all(found);
  Descriptor socket(::socket(all->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  if (socket.get() < 0 || ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
      ::bind(socket.get(), all->ai_addr, all->ai_addrlen) != 0 || ::listen(socket.get(), 512) != 0)
    return cannot_listen(where, last_error());
  return socket;
}

/// A client's address as text; of IPv6 the network, since one host has as many addresses as it likes.
std::string address_text(const ::sockaddr_storage& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address.ss_family == AF_INET) {
    ::inet_ntop(AF_INET, &reinterpret_cast<const ::sockaddr_in&>(address).sin_addr, text.data(), text.size());
  } else {
    auto bytes = reinterpret_cast<const ::sockaddr_in6&>(address).sin6_addr;
    if (!IN6_IS_ADDR_V4MAPPED(&bytes)) std::fill(bytes.s6_addr + 8, bytes.s6_addr + 16, std::uint8_t{0});
    ::inet_ntop(AF_INET6, &bytes, text.data(), text.size());
  }
  return text.data();
}

std::string_view reason_of(int status) {
  switch (status) {
    case 400:
      return "Bad Request";
    case 408:
      return "Request Timeout";
    case 411:
      return "Length Required";
    case 413:
      return "Payload Too Large";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

Reply refusal(int status, std::string_view field, std::string_view message) {
  const auto body = error_json(field, message);
  const std::string_view later = status == 429 || status == 503 ? "Retry-After: 2\r\n" : "";
  Reply reply;
  reply.status = status;
  reply.close = true;
  reply.text = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n"
      "Connection: close\r\nX-Content-Type-Options: nosniff\r\n{}\r\n{}",
      status, reason_of(status), body.size(), later, body);
  return reply;
}

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
    const bool full = counted_ >= limits_.connections;
    if (full) count_refused();
    if (full && (tls_ || connections_.size() - counted_ >= kMostExtra)) return;
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
    connection.counts = !full;
    counted_ += connection.counts;
    publish_counts();
    if (full) send_reply(id, connection, refusal(503, "connections", "too many connections are open"));
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
    if (connection.stream) end_stream(*connection.stream);
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

  void answered(Done& done) {
    const auto found = connections_.find(done.connection);
    if (found == connections_.end()) return;
    auto& connection = *found->second;
    if (done.reply.stream && streams_ >= limits_.streams) {
      count_refused();
      done.reply = refusal(503, "streams", "too many event streams are open");
    }
    if (done.reply.stream) {
      StreamQueue stream;
      stream.axis = done.reply.axis;
      auto beginning = begin_(done.reply.last_event_id);
      stream.alarms.assign(beginning.texts.begin(), beginning.texts.end());
      stream.last_id = beginning.id;
      begin_stream(stream);
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
    connection.out = std::make_shared<const std::string>(std::move(reply.text));
    connection.sent = 0;
    connection.close_after = reply.close;
    connection.phase = reply.stream ? Phase::streaming : Phase::sending;
    connection.since = now_;
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
        case Phase::sending:
          if (waited > seconds(limits_.stalled_s)) late.push_back(id);
          break;
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
  void begin_stream(const StreamQueue& stream) {
    ++streams_;
    publish_counts();
    const std::lock_guard lock(shared_mutex_);
    if (!stream.axis.empty()) ++watched_[stream.axis];
  }
  void end_stream(const StreamQueue& stream) {
    --streams_;
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

bool same_word(std::string_view a, std::string_view lower) {
  return std::equal(a.begin(), a.end(), lower.begin(), lower.end(), [](char x, char y) {
    return (x >= 'A' && x <= 'Z' ? static_cast<char>(x - 'A' + 'a') : x) == y;
  });
}

}  // namespace

RequestSize request_size(std::string_view received, const WebLimits& limits) {
  const auto refused = [](int status, std::string message) {
    return RequestSize{0, 0, status, std::move(message)};
  };
  const auto end = received.find("\r\n\r\n");
  if (std::min(end, received.size()) > limits.head_bytes)
    return refused(431, fmt::format("request line and headers exceed {} bytes", limits.head_bytes));
  if (end == std::string_view::npos) return {};
  const auto head = received.substr(0, end + 2);
  if (head.find('\0') != std::string_view::npos) return refused(400, "a header has a zero byte");
  RequestSize size{end + 4, 0, 0, {}};
  bool has_length = false;
  auto rest = head.substr(head.find("\r\n") + 2);
  while (!rest.empty()) {
    const auto line = rest.substr(0, rest.find("\r\n"));
    rest.remove_prefix(line.size() + 2);
    const auto colon = line.find(':');
    const auto name = line.substr(0, colon);
    if (colon == std::string_view::npos || name.empty() ||
        name.find_first_of(" \t\r\n") != std::string_view::npos)
      return refused(400, "a header is not of the form name: value");
    if (same_word(name, "transfer-encoding")) return refused(411, "a body needs a Content-Length");
    if (!same_word(name, "content-length")) continue;
    auto value = line.substr(colon + 1);
    while (!value.empty() && (value.front() == ' ' || value.front() == '\t')) value.remove_prefix(1);
    while (!value.empty() && (value.back() == ' ' || value.back() == '\t')) value.remove_suffix(1);
    const auto [stop, code] = std::from_chars(value.data(), value.data() + value.size(), size.body);
    if (code == std::errc::result_out_of_range || (code == std::errc{} && size.body > limits.body_bytes))
      return refused(413, fmt::format("the body exceeds {} bytes", limits.body_bytes));
    if (code != std::errc{} || stop != value.data() + value.size() || has_length)
      return refused(400, "one Content-Length in digits is required");
    has_length = true;
  }
  return size;
}

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
    return cannot_listen(listening, last_error());
  const auto port =
      ntohs(address.ss_family == AF_INET ? reinterpret_cast<::sockaddr_in&>(address).sin_port
                                         : reinterpret_cast<::sockaddr_in6&>(address).sin6_port);
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes to sockets without asking for its absence
  return std::make_unique<EpollSockets>(limits, std::move(*tls), std::move(*listener), std::move(epoll),
                                        std::move(wake), port);
}

}  // namespace resonid::monitor
