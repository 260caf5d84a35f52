! L5: the part of the C interface that is neighbours.h, as it is; module gamboge_c hands it on.
module gamboge_c_neighbours
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_funptr, c_int, c_int32_t, &
      c_int64_t, c_intptr_t, c_ptr
   implicit none
   public

   interface
      integer(c_int) function gbg_neighbours_create(context, dimension, lengths, radius, method, &
         skin, neighbours) bind(c)
         import
         type(c_ptr), value :: context
         integer(c_int), value :: dimension
         real(c_double), intent(in) :: lengths(*)
         real(c_double), value :: radius, skin
         character(kind=c_char), intent(in) :: method(*)
         type(c_ptr), intent(inout) :: neighbours
      end function gbg_neighbours_create

      integer(c_int) function gbg_neighbours_destroy(neighbours) bind(c)
         import
         type(c_ptr), intent(inout) :: neighbours
      end function gbg_neighbours_destroy

      integer(c_int) function gbg_neighbours_update(neighbours, n, x, y, z, step, searched) bind(c)
         import
         type(c_ptr), value :: neighbours, x, y, z
         integer(c_int64_t), value :: n
         integer(c_intptr_t), value :: step
         integer(c_int), intent(inout) :: searched
      end function gbg_neighbours_update

      integer(c_int) function gbg_neighbours_count(neighbours, n, pairs) bind(c)
         import
         type(c_ptr), value :: neighbours
         integer(c_int64_t), intent(inout) :: n, pairs
      end function gbg_neighbours_count

      integer(c_int) function gbg_neighbours_csr(neighbours, base, n_offsets, offset, capacity, &
         neighbour) bind(c)
         import
         type(c_ptr), value :: neighbours
         integer(c_int), value :: base
         integer(c_int64_t), value :: n_offsets, capacity
         integer(c_int64_t), intent(inout) :: offset(*)
         integer(c_int32_t), intent(inout) :: neighbour(*)
      end function gbg_neighbours_csr

      integer(c_int) function gbg_neighbours_pairs(neighbours, base, capacity, first, second) &
         bind(c)
         import
         type(c_ptr), value :: neighbours
         integer(c_int), value :: base
         integer(c_int64_t), value :: capacity
         integer(c_int32_t), intent(inout) :: first(*), second(*)
      end function gbg_neighbours_pairs

      integer(c_int) function gbg_neighbours_visit(neighbours, base, batch, user) bind(c)
         import
         type(c_ptr), value :: neighbours, user
         integer(c_int), value :: base
         type(c_funptr), value :: batch
      end function gbg_neighbours_visit

      integer(c_int) function gbg_neighbours_statistic(neighbours, name, value) bind(c)
         import
         type(c_ptr), value :: neighbours
         character(kind=c_char), intent(in) :: name(*)
         real(c_double), intent(inout) :: value
      end function gbg_neighbours_statistic

      integer(c_int) function gbg_neighbours_describe(neighbours, capacity, text) bind(c)
         import
         type(c_ptr), value :: neighbours
         integer(c_int64_t), value :: capacity
         character(kind=c_char), intent(inout) :: text(*)
      end function gbg_neighbours_describe
   end interface
end module gamboge_c_neighbours
