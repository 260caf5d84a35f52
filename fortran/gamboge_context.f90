! L5: the context (which backend, how many threads, where log lines go), statuses and components.
module gamboge_context
   use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_funloc, c_funptr, c_int, c_loc, &
      c_null_funptr, c_null_ptr, c_ptr
   use gamboge_c, only: c_has_component => gbg_has_component, &
      c_status_name => gbg_status_name, c_status_text => gbg_status_text, &
      gbg_context_backend, gbg_context_create, gbg_context_set_log, gbg_e_order, gbg_message, &
      gbg_ok, gbg_version_text
   use gamboge_tools, only: c_text, context_handle, context_hold, context_release, &
      context_state, f_text, gbg_log_line, report, stop_copy
   implicit none
   private

   public :: gbg_log_line, gbg_has_component, gbg_status_name, gbg_status_text, gbg_version

   ! Generic, since the C functions have these names too.
   interface gbg_has_component
      module procedure has_component
   end interface gbg_has_component
   interface gbg_status_name
      module procedure status_name
   end interface gbg_status_name
   interface gbg_status_text
      module procedure status_text
   end interface gbg_status_text

   ! For the modules of the other objects; not part of module gamboge.
   public :: context_of

   ! A context and the objects made from it belong to one thread at a time; several contexts may
   ! live in several threads. Not to be assigned or returned by a function.
   type, public :: gbg_context_t
      private
      type(context_state), pointer :: state => null()
   contains
      procedure, public :: create => context_create
      procedure, public :: destroy => context_destroy
      procedure, public :: message => context_message
      procedure, public :: backend => context_backend
      procedure, public :: set_log => context_set_log
      procedure, private :: copy => context_copy
      generic, public :: assignment(=) => copy
      final :: context_finalise
   end type gbg_context_t

contains

   subroutine context_create(self, backend, stat, errmsg)
      class(gbg_context_t), intent(inout) :: self
      ! 'cpu', 'cpu:threads=4', 'poison', 'cuda:0' or 'auto' (the default: a GPU if there is one)
      character(*), intent(in), optional :: backend
      ! 0, or why the call was refused; without it a failure stops the program
      integer, intent(out), optional :: stat
      ! set to a whole sentence (as much as it holds) by a failure only
      character(*), intent(inout), optional :: errmsg
      type(context_state), pointer :: fresh, none
      integer(c_int) :: status
      none => null()
      if (associated(self%state)) then
         call report(none, gbg_e_order, stat, errmsg, &
                     'gbg_context_t%create: this context exists already, destroy it first')
         return
      end if
      allocate (fresh)
      if (present(backend)) then
         status = gbg_context_create(c_text(backend), fresh%handle)
      else
         status = gbg_context_create(c_text('auto'), fresh%handle)
      end if
      if (status == gbg_ok) then
         call context_hold(fresh, self%state)
      else
         deallocate (fresh)
      end if
      call report(none, status, stat, errmsg)
   end subroutine context_create

   ! Twice is allowed. Objects made from the context may be destroyed before or after it.
   subroutine context_destroy(self)
      class(gbg_context_t), intent(inout) :: self
      call context_release(self%state)
   end subroutine context_destroy

   impure elemental subroutine context_finalise(self)
      type(gbg_context_t), intent(inout) :: self
      call context_release(self%state)
   end subroutine context_finalise

   ! The sentence of the last failed call on this context or its objects; '' if none failed.
   function context_message(self) result(message)
      class(gbg_context_t), intent(in) :: self
      character(:), allocatable :: message
      message = f_text(gbg_message(context_handle(self%state)))
   end function context_message

   ! What the context chose.
   subroutine context_backend(self, name, instructions, threads, stat, errmsg)
      class(gbg_context_t), intent(in) :: self
      ! 'cpu'
      character(:), allocatable, intent(out), optional :: name
      ! instruction set of the kernels: 'avx512', 'avx2' or 'generic'
      character(:), allocatable, intent(out), optional :: instructions
      integer, intent(out), optional :: threads
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(c_ptr) :: c_name, c_instructions
      integer(c_int) :: c_threads, status
      status = gbg_context_backend(context_handle(self%state), c_name, c_instructions, c_threads)
      if (status == gbg_ok) then
         if (present(name)) name = f_text(c_name)
         if (present(instructions)) instructions = f_text(c_instructions)
         if (present(threads)) threads = c_threads
      end if
      call report(self%state, status, stat, errmsg)
   end subroutine context_backend

   ! Sends log lines to a procedure of the caller; without sink they are dropped, as by default.
   subroutine context_set_log(self, sink, stat, errmsg)
      class(gbg_context_t), intent(in) :: self
      ! a module procedure
      procedure(gbg_log_line), optional :: sink
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(c_funptr) :: forward
      type(c_ptr) :: user
      integer(c_int) :: status
      forward = c_null_funptr
      user = c_null_ptr
      if (associated(self%state)) then
         user = c_loc(self%state)
         if (present(sink)) then
            self%state%sink => sink
            forward = c_funloc(forward_line)
         end if
      end if
      status = gbg_context_set_log(context_handle(self%state), forward, user)
      call report(self%state, status, stat, errmsg)
   end subroutine context_set_log

   ! What C calls; user is the context_state with the caller's procedure.
   subroutine forward_line(user, level, line) bind(c, name='')
      type(c_ptr), value :: user, line
      integer(c_int), value :: level
      type(context_state), pointer :: state
      call c_f_pointer(user, state)
      call state%sink(level, f_text(line))
   end subroutine forward_line

   subroutine context_copy(self, other)
      class(gbg_context_t), intent(inout) :: self
      class(gbg_context_t), intent(in) :: other
      if (associated(self%state) .or. associated(other%state)) call stop_copy('gbg_context_t')
   end subroutine context_copy

   function context_of(context) result(state)
      type(gbg_context_t), intent(in) :: context
      type(context_state), pointer :: state
      state => context%state
   end function context_of

   ! 'gamboge 0.1.0 ...': version and the components that this build has.
   function gbg_version() result(text)
      character(:), allocatable :: text
      text = f_text(gbg_version_text())
   end function gbg_version

   ! Does this build have 'fftw', 'netcdf', 'yaml', 'openmp' or 'cuda'?
   logical function has_component(component)
      character(*), intent(in) :: component
      has_component = c_has_component(c_text(component)) /= 0
   end function has_component

   ! 'GBG_E_STEP' for gbg_e_step.
   function status_name(status) result(name)
      integer, intent(in) :: status
      character(:), allocatable :: name
      name = f_text(c_status_name(int(status, c_int)))
   end function status_name

   ! Meaning of a status in a few words.
   function status_text(status) result(text)
      integer, intent(in) :: status
      character(:), allocatable :: text
      text = f_text(c_status_text(int(status, c_int)))
   end function status_text
end module gamboge_context
