// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <resonid/base/expected.hpp>
#include <span>
#include <string>
#include <vector>

#include "monitor/samples/arrival.hpp"

namespace resonid::monitor {

struct RingSettings {
  std::string axis;                   ///< 1 ... 64 bytes.
  std::vector<std::string> channels;  ///< 1 ... 16 names of 1 ... 32 bytes.
  double sample_rate_hz = 0.0;
  std::uint64_t capacity = 0;  ///< Samples, 64 ... 2^36. Three quarters of them can be unread.

  friend bool operator==(const RingSettings&, const RingSettings&) = default;
};

/// Consecutive samples in a ring.
struct Piece {
  std::uint64_t position = 0;           ///< Of the first.
  std::uint64_t first_sample = 0;       ///< Index of the first.
  std::optional<std::int64_t> time_ns;  ///< UNIX, of the first; where a sender told times.
  double interval_ns = 0.0;             ///< From one sample to the next, by the sender's clock.
  std::size_t samples = 0;
  std::span<const double> values;  ///< [sample][channel]; not a number: missing.
};

/// The newest samples of one axis in a memory-mapped file: the first place where a sample survives the end of
/// the process (not a power cut). A position counts the samples that are stored; the index of a sample
/// counts those too that are missing. Anchors tell which index and time belong to a position.
///
/// One thread writes, one reads, others may copy(); none waits for another. What is put becomes visible and
/// lasting with commit(), all at once: a process that is killed at any instant leaves the state before or
/// after it. Nothing unread is overwritten: room() says when the reader is too far behind.
class Ring {
 public:
  /// Opens the file, or makes it where there is none (or one whose making was interrupted). All of its space
  /// is taken from the disk now, so that a full disk is an error here and no signal later.
  ///
  /// Errors: settings out of range; the file cannot be made or mapped, the disk is full, another process (or
  /// another Ring) uses it, it is no ring, is damaged or of other settings.
  [[nodiscard]] static expected<std::unique_ptr<Ring>, Error> open(const std::filesystem::path& path,
                                                                   const RingSettings& settings);
  /// As open(). A ring of other settings is replaced by an empty one, which `renewed` says: its next sample
  /// has the index that was due, and source and sender go on where they were. A process that is killed leaves
  /// the one or the other. A damaged one, or zeros as a power cut may leave them, is renamed to
  /// PATH.damaged-N, which set_aside() says, and an empty one begun.
  [[nodiscard]] static expected<std::unique_ptr<Ring>, Error> open_or_renew(const std::filesystem::path& path,
                                                                            const RingSettings& settings,
                                                                            bool& renewed);
  Ring(const Ring&) = delete;
  Ring& operator=(const Ring&) = delete;
  ~Ring();

  [[nodiscard]] const RingSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] std::size_t channels() const noexcept { return settings_.channels.size(); }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// What was wrong with the file in whose place open_or_renew() made this one, and where that is now; empty:
  /// there was none.
  [[nodiscard]] const std::string& set_aside() const noexcept { return set_aside_; }

  // For the thread that writes.

  /// Most samples and anchors of one commit().
  [[nodiscard]] std::uint64_t most_samples() const noexcept { return settings_.capacity / 4; }
  static constexpr std::uint64_t kMostAnchors = 16;
  /// Whether so many more samples and anchors can be put. If not although they are within the limits of one
  /// commit(), the ring is full: after the reader has gone on, there will be room.
  [[nodiscard]] bool room(std::uint64_t samples, std::uint64_t anchors = 0) const noexcept;
  /// Puts whole samples ([sample][channel]), for which there is room().
  void put(std::span<const double> values) noexcept;
  void put_missing(std::uint64_t samples) noexcept;
  /// The next sample that is put has this index, not less than the one that was due, and this time. There
  /// must be room().
  /// @param interval_ns from one sample to the next, where the sender's clock does not agree with the rate
  void put_anchor(std::uint64_t sample, std::optional<std::int64_t> time_ns,
                  std::optional<double> interval_ns = std::nullopt) noexcept;
  /// @param sender_offset the index of a sample here less that by which its sender counts; for the caller
  void commit(const SourcePosition& source, std::uint64_t sender_offset = 0) noexcept;
  /// As of the last commit().
  [[nodiscard]] const SourcePosition& source() const noexcept { return source_; }
  [[nodiscard]] std::uint64_t sender_offset() const noexcept { return sender_offset_; }
  /// Time of a sample that would be put next, where it is known.
  [[nodiscard]] std::optional<std::int64_t> next_time_ns() const noexcept;
  /// Time from one sample to the next that the newest anchor tells.
  [[nodiscard]] double interval_ns() const noexcept;

  // For the thread that reads.

  /// The samples from there on that lie side by side, at most `most`; none at or after end(). Where what was
  /// asked for is overwritten it begins at begin(). Valid until set_read() goes beyond it.
  [[nodiscard]] Piece piece(std::uint64_t position, std::size_t most = SIZE_MAX) const noexcept;
  /// What lies before may be overwritten. When a file is opened that is begin().
  void set_read(std::uint64_t position) noexcept { read_.store(position, std::memory_order_release); }

  // For any thread.

  [[nodiscard]] std::uint64_t begin() const noexcept { return begin_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t end() const noexcept { return end_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t read() const noexcept { return read_.load(std::memory_order_acquire); }
  /// Index of the sample that is due next.
  [[nodiscard]] std::uint64_t next_sample() const noexcept {
    return next_sample_.load(std::memory_order_acquire);
  }
  /// As piece(), copied to `into`, to which `values` points then. No samples where they were overwritten
  /// meanwhile.
  [[nodiscard]] Piece copy(std::uint64_t position, std::size_t most, std::vector<double>& into) const;
  /// The position of the first sample with at least this index; end() where there is none.
  [[nodiscard]] std::uint64_t position_of(std::uint64_t sample) const noexcept;

 private:
  struct Anchor {
    std::uint64_t position = 0, sample = 0;
    std::int64_t time_ns = 0;
    double interval_ns = 0.0;
  };

  Ring() = default;
  /// As open(); `damage`: what is damaged of a ring that was found.
  [[nodiscard]] static expected<std::unique_ptr<Ring>, Error> open(const std::filesystem::path& path,
                                                                   const RingSettings& settings,
                                                                   std::string& damage);
  [[nodiscard]] static expected<std::unique_ptr<Ring>, Error> replace_damaged(
      const std::filesystem::path& path, const RingSettings& settings, const std::string& damage);
  [[nodiscard]] expected<void, Error> make(std::uint64_t bytes);
  [[nodiscard]] expected<void, Error> map(std::uint64_t bytes);
  [[nodiscard]] expected<void, Error> sync() const;
  [[nodiscard]] std::string restore();
  [[nodiscard]] unexpected<Error> failed(std::string what) const;
  [[nodiscard]] Anchor anchor(std::uint64_t number) const noexcept;
  void set_anchor(std::uint64_t number, const Anchor& anchor) const noexcept;
  [[nodiscard]] static std::uint64_t oldest_anchor(std::uint64_t count) noexcept;
  [[nodiscard]] std::uint64_t begin_at(std::uint64_t end, std::uint64_t anchors) const noexcept;
  template <class Before>
  [[nodiscard]] std::uint64_t last_anchor(std::uint64_t count, Before before) const noexcept;
  void write_slot() noexcept;

  std::filesystem::path path_;
  RingSettings settings_;
  std::string set_aside_;
  int descriptor_ = -1;
  std::byte* map_ = nullptr;
  std::uint64_t bytes_ = 0;
  double* data_ = nullptr;

  // The writer's.
  std::uint64_t sequence_ = 0;
  std::uint64_t put_end_ = 0;     ///< Position after what is put and not yet committed.
  std::uint64_t put_sample_ = 0;  ///< Index of the sample after that.
  std::uint64_t put_anchors_ = 0;
  SourcePosition source_;
  std::uint64_t sender_offset_ = 0;

  std::atomic<std::uint64_t> begin_{0}, end_{0}, next_sample_{0}, anchors_{0};
  std::atomic<std::uint64_t> read_{0};
};

}  // namespace resonid::monitor
