// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <resonid/base/expected.hpp>
#include <string>

#include "monitor/service/installation.hpp"
#include "monitor/web/backend.hpp"

namespace resonid::monitor {

/// The whole monitor of an installation: rings, sources, engine, store and web server.
class Service {
 public:
  /// Opens the data folder, goes on from where a former process was ended at whatever instant, and starts
  /// everything. Refused: what cannot work (a folder that takes no files, a damaged database, a port in use,
  /// an axis' specification). `installation` is kept.
  [[nodiscard]] static expected<std::unique_ptr<Service>, Error> start(Installation installation);
  ~Service();  ///< stop()
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  /// Sources first, then what is in the rings, then the store.
  void stop();
  /// All sources have ended, and what they brought is followed.
  [[nodiscard]] bool finished() const;
  /// Whether its engine goes on; a service that does not is to be ended by the watchdog.
  [[nodiscard]] bool healthy() const;
  [[nodiscard]] std::string url() const;
  [[nodiscard]] const web::Backend& backend() const;
  [[nodiscard]] web::Backend& backend();

 private:
  struct Parts;
  explicit Service(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace resonid::monitor
