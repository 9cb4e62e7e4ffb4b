#include "must.h"

#include "semihosting.h"

void must(dibs_code code) {
    if (code == DIBS_CODE_OK) {
        return;
    }
    semihosting_print(dibs_code_text(code));
    semihosting_print("\n");
    semihosting_exit(false);
}
