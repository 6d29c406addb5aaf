/* SPDX-License-Identifier: Apache-2.0 */
/* tests/view/test_guard.c -- whose Host is ours, which token is right, what is printed. */
#include "test_support.h"

#include <arpa/inet.h>

#include "view/guard.h"

static void check_hosts(const guard *g, const char *const *hosts, size_t count, bool ours)
{
    for (size_t i = 0; i < count; i++)
        if (guard_knows_host(g, hosts[i]) != ours)
            fail_msg("%s: \"%s\" is %sours", g->host, hosts[i], ours ? "" : "not ");
}

#define CHECK_HOSTS(g, hosts, ours) check_hosts(g, hosts, sizeof(hosts) / sizeof *(hosts), ours)

static const char *const foreign[] = {"",
                                      ":8470",
                                      "evil.example",
                                      "127.0.0.1.evil.example",
                                      "localhost.evil.example:8470",
                                      "127.0.0.1:80.evil.example",
                                      "127.0.0.1@evil.example",
                                      "[::1]:8470",
                                      " localhost",
                                      "localhost ",
                                      "127.0.0.1:1:2",
                                      "192.168.1.5.evil.example:8470",
                                      "192.168.1.5x",
                                      "192.168.1",
                                      "0x7f.1",
                                      "1111111111111111111111111111111111111111111111"};

static void hosts_of_this_machine(void **state)
{
    (void)state;
    static const char *const ours[] = {"127.0.0.1", "localhost", "127.0.0.1:8470", "LOCALHOST:1",
                                       "localhost:"};
    static const char *const others[] = {"127.0.0.2", "0.0.0.0", "192.168.1.5:8470"};
    guard g;
    assert_ok(guard_open(NULL, &g, NULL));
    CHECK_HOSTS(&g, ours, true);
    CHECK_HOSTS(&g, foreign, false);
    CHECK_HOSTS(&g, others, false);
    assert_false(guard_knows_host(&g, NULL));
    assert_ok(guard_open("127.0.0.2", &g, NULL));
    assert_true(guard_knows_host(&g, "127.0.0.2:8470") && g.token[0] == '\0');
}

/* A foreign name can be made to point here; a number cannot be another. */
static void hosts_with_a_token(void **state)
{
    (void)state;
    static const char *const ours[] = {"127.0.0.1:8470", "localhost", "192.168.1.5:8470", "10.0.0.1"};
    guard g;
    assert_ok(guard_open("0.0.0.0", &g, NULL));
    CHECK_HOSTS(&g, ours, true);
    CHECK_HOSTS(&g, foreign, false);
}

static void addresses(void **state)
{
    (void)state;
    static const char *const wrong[] = {"",    "example.org",    "192.168.1", "192.168.1.256",
                                        "::1", "192.168.1.5:80", "0.0.0.0/0", "-1"};
    guard g;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        gbt_error err = {0};
        assert_int_equal(guard_open(wrong[i], &g, &err), GBT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, "host: \""));
    }
    assert_ok(guard_open("localhost", &g, NULL));
    assert_true(g.address.s_addr == htonl(INADDR_LOOPBACK) && g.token[0] == '\0');
}

static void tokens(void **state)
{
    (void)state;
    guard g, other;
    assert_ok(guard_open("192.168.1.5", &g, NULL));
    assert_ok(guard_open("192.168.1.5", &other, NULL));
    assert_int_equal(strlen(g.token), 32);
    assert_int_equal(strspn(g.token, "0123456789abcdef"), 32);
    assert_string_not_equal(g.token, other.token);
    char given[64];
    assert_true(guard_knows_token(&g, g.token));
    for (size_t i = 0; i < 32; i++) {
        strcpy(given, g.token);
        given[i] ^= 1;
        assert_false(guard_knows_token(&g, given));
    }
    snprintf(given, sizeof given, "%sa", g.token);
    assert_false(guard_knows_token(&g, given));
    given[31] = '\0';
    assert_false(guard_knows_token(&g, given));
    assert_false(guard_knows_token(&g, ""));
    assert_false(guard_knows_token(&g, NULL));
    assert_ok(guard_open(NULL, &g, NULL));
    assert_true(guard_knows_token(&g, NULL));
}

static void what_is_opened(void **state)
{
    (void)state;
    guard g;
    char url[GUARD_URL_SIZE], wanted[GUARD_URL_SIZE];
    assert_ok(guard_open(NULL, &g, NULL));
    guard_url(&g, 8470, url);
    assert_string_equal(url, "http://127.0.0.1:8470");
    assert_ok(guard_open("192.168.1.5", &g, NULL));
    guard_url(&g, 80, url);
    snprintf(wanted, sizeof wanted, "http://192.168.1.5:80/?token=%s", g.token);
    assert_string_equal(url, wanted);
    assert_ok(guard_open("0.0.0.0", &g, NULL));
    guard_url(&g, 80, url);
    assert_null(strstr(url, "0.0.0.0")); /* nobody can open that */
    assert_non_null(strstr(url, g.token));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hosts_of_this_machine),
        cmocka_unit_test(hosts_with_a_token),
        cmocka_unit_test(addresses),
        cmocka_unit_test(tokens),
        cmocka_unit_test(what_is_opened),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
