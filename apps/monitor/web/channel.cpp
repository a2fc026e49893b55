// SPDX-License-Identifier: MIT
#include "monitor/web/channel.hpp"

#include <arpa/inet.h>
#include <fmt/core.h>
#include <netdb.h>
#include <netinet/in.h>
#include <openssl/err.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <system_error>

namespace resonid::monitor::web {
namespace {

Moved plain_result(::ssize_t bytes, Moved::End wants) {
  if (bytes > 0) return {Moved::End::some, static_cast<std::size_t>(bytes)};
  if (bytes < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return {wants, 0};
  return {Moved::End::closed, 0};
}

Moved tls_result(const SSL* tls, int result, std::size_t bytes) {
  if (result == 1) return {Moved::End::some, bytes};
  switch (SSL_get_error(tls, result)) {
    case SSL_ERROR_WANT_READ:
      return {Moved::End::wants_read, 0};
    case SSL_ERROR_WANT_WRITE:
      return {Moved::End::wants_write, 0};
    default:
      return {Moved::End::closed, 0};
  }
}

std::string socket_error() { return std::generic_category().message(errno); }

}  // namespace

Moved Channel::read(char* to, std::size_t size) {
  if (!tls_) return plain_result(::recv(fd(), to, size, 0), Moved::End::wants_read);
  std::size_t bytes = 0;
  ERR_clear_error();
  const int result = SSL_read_ex(tls_.get(), to, size, &bytes);
  return tls_result(tls_.get(), result, bytes);
}

Moved Channel::write(const char* from, std::size_t size) {
  if (!tls_) return plain_result(::send(fd(), from, size, MSG_NOSIGNAL), Moved::End::wants_write);
  std::size_t bytes = 0;
  ERR_clear_error();
  const int result = SSL_write_ex(tls_.get(), from, size, &bytes);
  return tls_result(tls_.get(), result, bytes);
}

void Channel::finish() {
  ERR_clear_error();
  if (tls_ && SSL_is_init_finished(tls_.get())) static_cast<void>(SSL_shutdown(tls_.get()));
  ::shutdown(fd(), SHUT_WR);
  tls_.reset();
}

unexpected<Error> cannot_listen(const Listening& where, std::string_view why) {
  return unexpected<Error>(
      Error{"listen", fmt::format("cannot listen on {} port {}: {}", where.address, where.port, why)});
}

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
  // Nobody is there to be asked for the password of a key.
  SSL_CTX_set_default_passwd_cb(context.get(), [](char*, int, int, void*) { return -1; });
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
    return cannot_listen(where, socket_error());
  return socket;
}

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

bool is_this_machine(std::string_view address_text) noexcept {
  // "::" is the network of ::1, in which no other host is.
  return address_text == "::" || address_text.starts_with("127.") || address_text.starts_with("::ffff:127.");
}

}  // namespace resonid::monitor::web
