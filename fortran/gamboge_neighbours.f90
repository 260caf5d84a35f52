! L5: all pairs of particles within a radius, on the caller's own arrays x(2,n), x(3,n) or x(n),
! y(n), z(n) of any layout. Particles count from 1. Single-precision arguments, or separate arrays
! of different strides, cost a copy.
module gamboge_neighbours
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_f_pointer, c_funloc, c_int, &
      c_int32_t, c_int64_t, c_loc, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use gamboge_c, only: gbg_e_order, gbg_neighbours_count, gbg_neighbours_create, &
      gbg_neighbours_csr, gbg_neighbours_describe, gbg_neighbours_destroy, gbg_neighbours_pairs, &
      gbg_neighbours_statistic, gbg_neighbours_update, gbg_neighbours_visit, gbg_ok
   use gamboge_context, only: context_of, gbg_context_t
   use gamboge_layout, only: drop, points, take
   use gamboge_tools, only: buffer_text, c_text, context_handle, context_hold, context_release, &
      context_state, narrow, report, stop_copy, text_capacity
   implicit none
   private

   public :: gbg_pair_batch

   ! Not to be assigned or returned by a function.
   type, public :: gbg_neighbours_t
      private
      type(c_ptr) :: handle = c_null_ptr
      type(context_state), pointer :: context => null()
      integer :: axes = 0
   contains
      generic, public :: create => create64, create32
      procedure, public :: destroy => neighbours_destroy
      ! Finds the pairs; then the procedures below read them.
      generic, public :: update => matrix64, separate64, matrix32, separate32
      generic, public :: get_count => count_int32, count_int64
      procedure, public :: get_csr => neighbours_csr
      procedure, public :: get_pairs => neighbours_pairs
      procedure, public :: visit => neighbours_visit
      procedure, public :: get_statistic => neighbours_statistic
      procedure, public :: describe => neighbours_describe
      procedure, private :: create64, create32, matrix64, separate64, matrix32, separate32
      procedure, private :: count_int32, count_int64
      procedure, private :: copy => neighbours_copy
      generic, public :: assignment(=) => copy
      final :: neighbours_finalise
   end type gbg_neighbours_t

   abstract interface
      ! What receives some of the pairs. Give a module procedure: an internal one would need an
      ! executable stack.
      subroutine gbg_pair_batch(first, second, separation)
         import :: int32, real64
         ! of each pair, first < second
         integer(int32), intent(in) :: first(:), second(:)
         ! (2 or 3, pairs): r(first) - r(second), nearest image [length]
         real(real64), intent(in) :: separation(:, :)
      end subroutine gbg_pair_batch
   end interface

   ! What C hands back to the caller's procedure.
   type :: batch_state
      procedure(gbg_pair_batch), pointer, nopass :: batch => null()
      integer :: axes = 0
   end type batch_state

   character(*), parameter :: updating = 'gbg_neighbours_t%update'

contains

   ! A search in a periodic box of size(lengths) dimensions for pairs at distances up to radius,
   ! which is included.
   subroutine create64(self, context, lengths, radius, method, skin, stat, errmsg)
      class(gbg_neighbours_t), intent(inout) :: self
      type(gbg_context_t), intent(in) :: context
      ! box lengths, 2 or 3 of them [length]
      real(real64), intent(in) :: lengths(:)
      ! [length], at most half the shortest box length
      real(real64), intent(in) :: radius
      ! 'auto' (the default), 'grid', 'grid2', 'half', 'octant', 'octant:2.52', 'occupancy:0.9',
      ! 'verlet', 'brute'
      character(*), intent(in), optional :: method
      ! of the list of 'verlet', kept while nobody moves more than half of it [length]; 0 without it
      real(real64), intent(in), optional :: skin
      ! 0, or why the call was refused; without it a failure stops the program
      integer, intent(out), optional :: stat
      ! set to a whole sentence (as much as it holds) by a failure only
      character(*), intent(inout), optional :: errmsg
      type(context_state), pointer :: state
      character(:), allocatable :: name
      real(real64) :: width
      integer(c_int) :: status
      state => context_of(context)
      if (associated(self%context)) then
         call report(state, gbg_e_order, stat, errmsg, &
                     'gbg_neighbours_t%create: this search exists already, destroy it first')
         return
      end if
      name = 'auto'
      width = 0
      if (present(method)) name = method
      if (present(skin)) width = skin
      status = gbg_neighbours_create(context_handle(state), size(lengths), lengths, radius, &
                                     c_text(name), width, self%handle)
      if (status == gbg_ok) then
         call context_hold(state, self%context)
         self%axes = size(lengths)
      end if
      call report(state, status, stat, errmsg)
   end subroutine create64

   subroutine create32(self, context, lengths, radius, method, skin, stat, errmsg)
      class(gbg_neighbours_t), intent(inout) :: self
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(in) :: radius
      character(*), intent(in), optional :: method
      real(real32), intent(in), optional :: skin
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64) :: width
      width = 0
      if (present(skin)) width = skin
      call self%create(context, real(lengths, real64), real(radius, real64), method, width, stat, &
                       errmsg)
   end subroutine create32

   ! Twice is allowed.
   subroutine neighbours_destroy(self)
      class(gbg_neighbours_t), intent(inout) :: self
      integer(c_int) :: status
      status = gbg_neighbours_destroy(self%handle)
      call context_release(self%context)
      self%axes = 0
   end subroutine neighbours_destroy

   impure elemental subroutine neighbours_finalise(self)
      type(gbg_neighbours_t), intent(inout) :: self
      call neighbours_destroy(self)
   end subroutine neighbours_finalise

   subroutine matrix64(self, x, searched, stat, errmsg)
      class(gbg_neighbours_t), intent(inout) :: self
      ! x(2,n) or x(3,n) [length], any finite value, taken modulo the box; in two dimensions a third
      ! row is ignored
      real(real64), intent(in), target :: x(:, :)
      ! .false. if a list was still good
      logical, intent(inout), optional :: searched
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, updating, self%axes, x)
      call find(self, p, searched)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine matrix64

   subroutine separate64(self, x, y, z, searched, stat, errmsg)
      class(gbg_neighbours_t), intent(inout) :: self
      real(real64), intent(in), target :: x(:), y(:)
      ! in three dimensions
      real(real64), intent(in), optional, target :: z(:)
      logical, intent(inout), optional :: searched
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, updating, self%axes, x, y, z)
      call find(self, p, searched)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine separate64

   subroutine matrix32(self, x, searched, stat, errmsg)
      class(gbg_neighbours_t), intent(inout) :: self
      real(real32), intent(in) :: x(:, :)
      logical, intent(inout), optional :: searched
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, updating, self%axes, x)
      call find(self, p, searched)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine matrix32

   subroutine separate32(self, x, y, z, searched, stat, errmsg)
      class(gbg_neighbours_t), intent(inout) :: self
      real(real32), intent(in) :: x(:), y(:)
      real(real32), intent(in), optional :: z(:)
      logical, intent(inout), optional :: searched
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, updating, self%axes, x, y, z)
      call find(self, p, searched)
      call report(self%context, p%status, stat, errmsg, p%problem)
   end subroutine separate32

   subroutine find(self, p, searched)
      class(gbg_neighbours_t), intent(inout) :: self
      type(points), intent(inout) :: p
      logical, intent(inout), optional :: searched
      integer(c_int) :: flag
      flag = 0
      if (p%status == gbg_ok) p%status = &
         gbg_neighbours_update(self%handle, p%n, p%x, p%y, p%z, p%step, flag)
      if (p%status == gbg_ok .and. present(searched)) searched = flag /= 0
      call drop(p)
   end subroutine find

   ! Pairs of the last update, each counted once.
   subroutine count_int64(self, pairs, stat, errmsg)
      class(gbg_neighbours_t), intent(in) :: self
      integer(int64), intent(inout) :: pairs
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int64_t) :: n, found
      integer(c_int) :: status
      status = gbg_neighbours_count(self%handle, n, found)
      if (status == gbg_ok) pairs = found
      call report(self%context, status, stat, errmsg)
   end subroutine count_int64

   subroutine count_int32(self, pairs, stat, errmsg)
      class(gbg_neighbours_t), intent(in) :: self
      integer(int32), intent(inout) :: pairs
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int64_t) :: n, found
      integer(c_int) :: status
      character(:), allocatable :: problem
      status = gbg_neighbours_count(self%handle, n, found)
      call narrow('gbg_neighbours_t%get_count: pairs', found, pairs, status, problem)
      call report(self%context, status, stat, errmsg, problem)
   end subroutine count_int32

   ! Neighbours of particle i in ascending order: neighbour(offset(i):offset(i + 1) - 1), both
   ! directions of every pair. Arrays that are too small, or not there, are allocated anew.
   subroutine neighbours_csr(self, offset, neighbour, stat, errmsg)
      class(gbg_neighbours_t), intent(in) :: self
      ! n + 1 elements or more
      integer(int64), allocatable, intent(inout) :: offset(:)
      integer(int32), allocatable, intent(inout) :: neighbour(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int64_t) :: n, pairs
      integer(c_int) :: status
      status = gbg_neighbours_count(self%handle, n, pairs)
      if (status == gbg_ok) then
         if (allocated(offset)) then
            if (size(offset, kind=int64) < n + 1) deallocate (offset)
         end if
         if (.not. allocated(offset)) allocate (offset(n + 1))
         call room(neighbour, 2*pairs)
         status = gbg_neighbours_csr(self%handle, 1_c_int, size(offset, kind=int64), offset, &
                                     size(neighbour, kind=int64), neighbour)
      end if
      call report(self%context, status, stat, errmsg)
   end subroutine neighbours_csr

   ! Every pair once, first < second, sorted: the first `count` elements. Arrays as for get_csr.
   subroutine neighbours_pairs(self, first, second, stat, errmsg)
      class(gbg_neighbours_t), intent(in) :: self
      integer(int32), allocatable, intent(inout) :: first(:), second(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(c_int64_t) :: n, pairs
      integer(c_int) :: status
      status = gbg_neighbours_count(self%handle, n, pairs)
      if (status == gbg_ok) then
         call room(first, pairs)
         call room(second, pairs)
         status = gbg_neighbours_pairs(self%handle, 1_c_int, pairs, first, second)
      end if
      call report(self%context, status, stat, errmsg)
   end subroutine neighbours_pairs

   subroutine room(array, needed)
      integer(int32), allocatable, intent(inout) :: array(:)
      integer(int64), intent(in) :: needed
      if (allocated(array)) then
         if (size(array, kind=int64) < needed) deallocate (array)
      end if
      if (.not. allocated(array)) allocate (array(needed))
   end subroutine room

   ! Hands every pair to batch, in the order of get_pairs, some thousands at a time.
   subroutine neighbours_visit(self, batch, stat, errmsg)
      class(gbg_neighbours_t), intent(in) :: self
      ! a module procedure
      procedure(gbg_pair_batch) :: batch
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(batch_state), target :: state
      integer(c_int) :: status
      state%batch => batch
      state%axes = self%axes
      status = gbg_neighbours_visit(self%handle, 1_c_int, c_funloc(forward_batch), c_loc(state))
      call report(self%context, status, stat, errmsg)
   end subroutine neighbours_visit

   ! What C calls; user is the batch_state with the caller's procedure.
   subroutine forward_batch(user, n, first, second, separation) bind(c, name='')
      type(c_ptr), value :: user, first, second, separation
      integer(c_int64_t), value :: n
      type(batch_state), pointer :: state
      integer(c_int32_t), pointer :: i(:), j(:)
      real(c_double), pointer :: r(:, :)
      call c_f_pointer(user, state)
      call c_f_pointer(first, i, [n])
      call c_f_pointer(second, j, [n])
      call c_f_pointer(separation, r, [int(state%axes, c_int64_t), n])
      call state%batch(i, j, r)
   end subroutine forward_batch

   ! Of the last update: 'candidates', 'neighbours' (mean of a particle), 'cells'; since create:
   ! 'updates', 'searches'.
   subroutine neighbours_statistic(self, name, value, stat, errmsg)
      class(gbg_neighbours_t), intent(in) :: self
      character(*), intent(in) :: name
      real(real64), intent(inout) :: value
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      call report(self%context, gbg_neighbours_statistic(self%handle, c_text(name), value), stat, &
                  errmsg)
   end subroutine neighbours_statistic

   ! What the last update did: 'grid, 31x31 cells of 1.03 radius'.
   subroutine neighbours_describe(self, text, stat, errmsg)
      class(gbg_neighbours_t), intent(in) :: self
      character(:), allocatable, intent(inout) :: text
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      character(kind=c_char) :: buffer(text_capacity)
      integer(c_int) :: status
      status = gbg_neighbours_describe(self%handle, size(buffer, kind=int64), buffer)
      if (status == gbg_ok) text = buffer_text(buffer)
      call report(self%context, status, stat, errmsg)
   end subroutine neighbours_describe

   subroutine neighbours_copy(self, other)
      class(gbg_neighbours_t), intent(inout) :: self
      class(gbg_neighbours_t), intent(in) :: other
      if (associated(self%context) .or. associated(other%context)) &
         call stop_copy('gbg_neighbours_t')
   end subroutine neighbours_copy
end module gamboge_neighbours
