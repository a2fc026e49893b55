// SPDX-License-Identifier: MIT
#include <resonid/c/detail/types.h>

#include "crc32.hpp"
#include "handle.hpp"

namespace resonid::c {
namespace {

/// Of the header with the checksum 0 and the `size - sizeof(Header)` bytes behind it, which may lack
/// alignment.
std::uint32_t checksum(const Header& of, const void* snapshot) noexcept {
  Header header = of;
  header.checksum = 0;
  Crc32 crc;
  crc.add(&header, sizeof header);
  crc.add(static_cast<const unsigned char*>(snapshot) + sizeof header, header.size - sizeof header);
  return crc.value();
}

/// The header of an undamaged snapshot, or why it is none.
resonid_status check(const void* snapshot, std::size_t size, std::uint32_t kind, Header& h,
                     resonid_error* error) noexcept {
  if (snapshot == nullptr) return fail_null(error, "snapshot");
  if (size < sizeof h) return fail(error, RESONID_ERROR_SIZE, "size", "is less than a header has");
  std::memcpy(&h, snapshot, sizeof h);
  if (h.magic != kSnapshot) return fail(error, RESONID_ERROR_HANDLE, "snapshot", "must be a snapshot");
  if (h.version != kVersion)
    return fail(error, RESONID_ERROR_HANDLE, "snapshot", "must be of this library version");
  if (kind != 0 && h.kind != kind)
    return fail(error, RESONID_ERROR_HANDLE, "kind", "must be that of the snapshot", h.kind);
  if (operations_of(h) == nullptr)
    return fail(error, RESONID_ERROR_SNAPSHOT, "snapshot",
                "must be undamaged: there is no such kind or size");
  if (size < h.size)
    return fail(error, RESONID_ERROR_SIZE, "size", "is less than the snapshot has",
                static_cast<double>(size));
  if (checksum(h, snapshot) != h.checksum)
    return fail(error, RESONID_ERROR_SNAPSHOT, "snapshot", "must be undamaged: the checksum is wrong");
  return RESONID_OK;
}

}  // namespace
}  // namespace resonid::c

using resonid::c::fail;
using resonid::c::Header;
using resonid::c::Operations;

resonid_status resonid_snapshot(const resonid_handle* handle, void* snapshot, size_t size,
                                resonid_error* error) noexcept {
  if (snapshot == nullptr) return resonid::c::fail_null(error, "snapshot");
  const resonid_status status = resonid::c::with(handle, [](const Operations&) { return RESONID_OK; });
  if (status != RESONID_OK) return fail(error, status, "handle", "must be a handle of this library version");
  Header h = *reinterpret_cast<const Header*>(handle);
  if (size < h.size)
    return fail(error, RESONID_ERROR_SIZE, "size", "is less than the handle has", static_cast<double>(size));
  std::memcpy(snapshot, handle, h.size);
  h.magic = resonid::c::kSnapshot;
  h.checksum = resonid::c::checksum(h, snapshot);
  std::memcpy(snapshot, &h, sizeof h);
  return RESONID_OK;
}

resonid_status resonid_check(const void* snapshot, size_t size, uint32_t kind,
                             resonid_error* error) noexcept {
  Header h;
  return resonid::c::check(snapshot, size, kind, h, error);
}

resonid_status resonid_restore(void* memory, size_t memory_size, const void* snapshot, size_t snapshot_size,
                               uint32_t kind, resonid_handle** handle, resonid_error* error) noexcept {
  if (memory == nullptr) return resonid::c::fail_null(error, "memory");
  if (handle == nullptr) return resonid::c::fail_null(error, "handle");
  if (reinterpret_cast<std::uintptr_t>(memory) % RESONID_ALIGNMENT != 0)
    return fail(error, RESONID_ERROR_ALIGNMENT, "memory", "must be aligned to RESONID_ALIGNMENT");
  Header h;
  if (const resonid_status status = resonid::c::check(snapshot, snapshot_size, kind, h, error)) return status;
  if (memory_size < h.size)
    return fail(error, RESONID_ERROR_SIZE, "memory_size", "is less than the snapshot has",
                static_cast<double>(memory_size));
  std::memmove(memory, snapshot, h.size);
  // Whoever can compute a checksum can write any state behind it.
  if (!resonid::c::operations_of(h)->intact(memory)) {
    std::memset(memory, 0, sizeof h);
    return fail(error, RESONID_ERROR_SNAPSHOT, "snapshot", "must hold a state that an estimator can be in");
  }
  h.magic = resonid::c::kHandle;
  h.checksum = 0;
  std::memcpy(memory, &h, sizeof h);
  *handle = static_cast<resonid_handle*>(memory);
  return RESONID_OK;
}
