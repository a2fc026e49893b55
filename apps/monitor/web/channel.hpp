// SPDX-License-Identifier: MIT
#pragma once

#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "monitor/web/sockets.hpp"

namespace resonid::monitor::web {

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

/// A client's connection, plain or TLS; nothing here waits.
class Channel {
 public:
  Channel(Descriptor socket, Tls tls) : socket_(std::move(socket)), tls_(std::move(tls)) {}
  [[nodiscard]] Moved read(char* to, std::size_t size);
  [[nodiscard]] Moved write(const char* from, std::size_t size);
  void finish();  ///< Nothing more is sent, and what still comes is not looked at.
  [[nodiscard]] int fd() const noexcept { return socket_.get(); }

 private:
  Descriptor socket_;
  Tls tls_;
};

/// Made of the files of certificate and key; empty where there are none.
[[nodiscard]] expected<TlsContext, Error> tls_context(const Listening&);
[[nodiscard]] expected<Descriptor, Error> listening_socket(const Listening&);
/// Says that it cannot be listened there.
[[nodiscard]] unexpected<Error> cannot_listen(const Listening&, std::string_view why);

/// A client's address as text; of IPv6 the network, since one host has as many addresses as it likes.
[[nodiscard]] std::string address_text(const ::sockaddr_storage&);
/// Whether such a text is of this machine itself.
[[nodiscard]] bool is_this_machine(std::string_view address_text) noexcept;

}  // namespace resonid::monitor::web
