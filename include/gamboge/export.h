/* Public: marks the symbols that the shared libraries show. */
#ifndef GAMBOGE_EXPORT_H
#define GAMBOGE_EXPORT_H

#if defined(__GNUC__) || defined(__clang__)
#define GBG_API __attribute__((visibility("default")))
#else
#define GBG_API
#endif

#endif
