#include "print.h"

#include <stdio.h>
#include <string.h>

#include "bus.h"

void print_floats(const float *values, size_t count) {
    for (size_t at = 0; at < count; at++) {
        uint32_t bits;
        memcpy(&bits, &values[at], sizeof bits);
        printf(" %08x", bits);
    }
}

void print_vec3(dibs_vec3 value) {
    print_floats((float[]){value.x, value.y, value.z}, 3);
}

void print_proximity(const dibs_proximity *found) {
    printf(" %u", found->side);
    print_floats((float[]){found->separation, found->lower, found->accuracy, found->axis_distance}, 4);
    print_vec3(found->point_on_surface);
    print_vec3(found->point_on_tool);
    print_vec3(found->direction);
    print_floats(&found->axis_parameter, 1);
    print_floats(found->barycentric, 3);
    printf(" %u %u %u %u", found->triangle, found->corners[0], found->corners[1], found->corners[2]);
    printf(" %u %u", found->node_tests, found->triangle_tests);
}

void print_contacts(dibs_contacts *contacts) {
    dibs_contacts_facts facts;
    must(dibs_contacts_get_facts(contacts, &facts));
    printf(" %u %u", facts.count, facts.is_full);
    print_floats((float[]){facts.bound, facts.accuracy}, 2);
    for (uint32_t number = 0; number < facts.count; number++) {
        dibs_contact contact;
        must(dibs_contacts_get(contacts, number, &contact));
        printf(" %u %u", contact.surface, contact.tool);
        print_floats(&contact.separation, 1);
        print_vec3(contact.normal);
        print_vec3(contact.point_on_tool);
    }
}

void print_force(const dibs_force *force) {
    printf(" %u %u", force->state, force->cause);
    print_vec3(force->force);
    print_vec3(force->torque);
}
