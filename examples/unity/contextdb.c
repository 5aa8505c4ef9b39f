/* The library that ContextTable.cs and ContextCharacters.cs call: the exported functions of the header, and nothing else. */
#if defined(_WIN32)
#define CDB_API __declspec(dllexport)
#else
#define CDB_API __attribute__((visibility("default")))
#endif
#define CDB_IMPLEMENTATION
#include "contextdb_motion.h"
