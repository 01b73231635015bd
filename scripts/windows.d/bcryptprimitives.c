/* The library from which Rust programs take random numbers on Windows, which wine has from version 9 on: this stands for it
   in older ones. Windows itself has its own. */
#include <windows.h>
#include <ntsecapi.h>

__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T size) {
    return RtlGenRandom(data, (ULONG)size);
}
