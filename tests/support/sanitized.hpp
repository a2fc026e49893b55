// SPDX-License-Identifier: MIT
#pragma once

/// 1 when a sanitizer is built in, which has its own heap, takes locks and makes system calls.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define RESONID_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define RESONID_SANITIZED 1
#endif
#endif
#ifndef RESONID_SANITIZED
#define RESONID_SANITIZED 0
#endif
